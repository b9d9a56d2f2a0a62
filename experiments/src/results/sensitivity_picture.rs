//! Sensitivity maps as a picture: one panel per parameter, time to the right, the rope from
//! the clamp down to the lead.

use super::sensitivity_map::SensitivityMap;
use shared_types::rope::RANGES;
use std::fmt::Write as _;

/// Panels side by side, their size, and what is between them (px).
const COLUMNS: usize = 3;
const PANEL: [f64; 2] = [300.0, 132.0];
const GAP: [f64; 2] = [40.0, 62.0];
const LEFT: f64 = 60.0;
const TOP: f64 = 84.0;

/// From none to the largest of a panel: white, through orange, to dark red.
fn colour(part: f64) -> String {
    const STOPS: [[f64; 3]; 3] = [
        [255.0, 255.0, 255.0],
        [247.0, 148.0, 60.0],
        [127.0, 16.0, 32.0],
    ];
    let place = 2.0 * part.clamp(0.0, 1.0);
    let (from, to) = if place < 1.0 { (0, 1) } else { (1, 2) };
    let along = if place < 1.0 { place } else { place - 1.0 };
    let mixed = |i: usize| STOPS[from][i] + (STOPS[to][i] - STOPS[from][i]) * along;
    format!("rgb({:.0},{:.0},{:.0})", mixed(0), mixed(1), mixed(2))
}

/// The maps, each in parts of its largest value, which is printed above it.
pub(super) fn svg(map: &SensitivityMap, moment_s: f64, films: usize, seed: u64) -> String {
    let rows = RANGES.len().div_ceil(COLUMNS) as f64;
    let width = LEFT + COLUMNS as f64 * (PANEL[0] + GAP[0]);
    let height = TOP + rows * (PANEL[1] + GAP[1]);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"24\" font-size=\"15\">What the network's answer depends on: mean of {films} films, seed {seed}</text>\n\
         <text x=\"{LEFT}\" y=\"44\" fill=\"#555\">size of the gradient over a keypoint's place; dark: the largest, in fractions of the range per metre</text>\n"
    );
    for (parameter, range) in RANGES.iter().enumerate() {
        let (column, row) = (parameter % COLUMNS, parameter / COLUMNS);
        let at = [
            LEFT + column as f64 * (PANEL[0] + GAP[0]),
            TOP + row as f64 * (PANEL[1] + GAP[1]),
        ];
        panel(&mut out, map, (parameter, range.label), at, moment_s);
    }
    out.push_str("</svg>\n");
    out
}

fn panel(
    out: &mut String,
    map: &SensitivityMap,
    (parameter, label): (usize, &str),
    [left, top]: [f64; 2],
    moment_s: f64,
) {
    let values = &map.values[parameter];
    let largest = f64::from(values.iter().copied().fold(0.0, f32::max));
    let cell = [
        PANEL[0] / map.moments as f64,
        PANEL[1] / map.keypoints as f64,
    ];
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "<g class=\"map\"><text x=\"{left:.1}\" y=\"{:.1}\">{label} (largest {largest:.2})</text>",
        top - 6.0
    );
    for (i, value) in values.iter().enumerate() {
        let (moment, keypoint) = (i / map.keypoints, i % map.keypoints);
        let _ = writeln!(
            out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
            left + moment as f64 * cell[0],
            top + keypoint as f64 * cell[1],
            cell[0] + 0.3,
            cell[1] + 0.3,
            colour(f64::from(*value) / largest.max(f64::MIN_POSITIVE))
        );
    }
    let bottom = top + PANEL[1];
    let _ = writeln!(
        out,
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"black\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#555\">clamp</text>\n\
         <text x=\"{:.1}\" y=\"{bottom:.1}\" text-anchor=\"end\" fill=\"#555\">lead</text>",
        PANEL[0],
        PANEL[1],
        left - 5.0,
        top + 11.0,
        left - 5.0
    );
    let film_s = map.moments as f64 * moment_s;
    for second in (0_u32..).map(f64::from).take_while(|s| *s <= film_s) {
        let x = left + second / film_s * PANEL[0];
        let _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{second:.0}</text>",
            bottom + 15.0
        );
    }
    let _ = writeln!(
        out,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#555\">time in the wiggle (s)</text></g>",
        left + PANEL[0] / 2.0,
        bottom + 31.0
    );
}
