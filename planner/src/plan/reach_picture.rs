//! The reach of a rope as a picture.

use super::reach_map::{CELL_M, ReachMap};
use shared_types::RopeParams;
use std::fmt::Write as _;

/// Pixels per metre, and margins for axes and words.
const SCALE: f64 = 420.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 60.0;
/// What is shown: distance from the base axis and height (m).
const RHO_M: [f64; 2] = [-0.6, 1.6];
const Z_M: [f64; 2] = [-0.8, 1.6];
/// Throws through a cell from which it counts as easy to reach.
const OFTEN: u32 = 20;
const COLOURS: [&str; 2] = ["#a9cde8", "#2f7fbf"];

fn x(rho_m: f64) -> f64 {
    LEFT + SCALE * (rho_m - RHO_M[0])
}

fn y(z_m: f64) -> f64 {
    TOP + SCALE * (Z_M[1] - z_m)
}

/// An SVG picture of the cells that `rope` reached seldom and often in `map`, which was
/// explored with `seed`, and of the target (m, world frame), in the plane of both.
#[must_use]
pub fn reach_svg(map: &ReachMap, rope: &RopeParams, target_m: [f64; 3], seed: u64) -> String {
    let (width, height) = (x(RHO_M[1]) + 30.0, y(Z_M[0]) + 60.0);
    let edge = SCALE * CELL_M;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" \
         font-family=\"sans-serif\" font-size=\"14\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{LEFT}\" y=\"24\">Reach of a rope of {:.3} m with a lead of {:.0} g: {} throws, seed {seed}</text>\n\
         <text x=\"{LEFT}\" y=\"44\" fill=\"#555\">dark: {OFTEN} throws or more passed; light: fewer; cross: target</text>\n",
        rope.length_m,
        1e3 * rope.lead_mass_kg,
        map.throws
    );
    // Writing to a string cannot fail.
    for (cell, passed) in &map.cells {
        let [rho, z] = ReachMap::middle_m(*cell);
        let colour = COLOURS[usize::from(*passed >= OFTEN)];
        let _ = writeln!(
            out,
            "<rect x=\"{:.1}\" y=\"{:.1}\" width=\"{edge:.1}\" height=\"{edge:.1}\" fill=\"{colour}\"/>",
            x(rho) - edge / 2.0,
            y(z) - edge / 2.0
        );
    }
    axes(&mut out);
    let (tx, ty) = (x(target_m[0].hypot(target_m[1])), y(target_m[2]));
    let _ = writeln!(
        out,
        "<path d=\"M{:.1} {ty:.1}h16M{tx:.1} {:.1}v16\" stroke=\"#d03030\" stroke-width=\"3\"/>\n</svg>",
        tx - 8.0,
        ty - 8.0
    );
    out
}

fn axes(out: &mut String) {
    let [left, right] = RHO_M.map(x);
    let [bottom, top] = Z_M.map(y);
    let _ = writeln!(
        out,
        "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"none\" stroke=\"black\"/>\n\
         <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">distance from the base axis (m)</text>\n\
         <text transform=\"translate(18 {:.1}) rotate(-90)\" text-anchor=\"middle\">height above the base (m)</text>",
        right - left,
        bottom - top,
        (left + right) / 2.0,
        bottom + 44.0,
        (bottom + top) / 2.0
    );
    let mut tick = |x: f64, y: f64, anchor, v: f64| {
        let _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{v:.1}</text>"
        );
    };
    for k in -3..=8 {
        let v = 0.2 * f64::from(k);
        if (RHO_M[0] - 1e-9..=RHO_M[1] + 1e-9).contains(&v) {
            tick(x(v), bottom + 20.0, "middle", v);
        }
        tick(left - 8.0, y(v) + 5.0, "end", v);
    }
}
