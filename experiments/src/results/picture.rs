//! A result as a picture: how many trials lie below each value, and what the paper has.

use anyhow::anyhow;
use cli_output::{OrInput, Outcome};
use plotters::prelude::*;
use run_log::files;
use shared_types::VERSION;
use std::path::{Path, PathBuf};

const SIZE: (u32, u32) = (900, 520);
/// Colours that most colour-blind readers can tell apart (Okabe and Ito).
const COLOURS: [RGBColor; 9] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
    RGBColor(230, 159, 0),
    RGBColor(0, 0, 0),
    RGBColor(140, 86, 75),
];

/// One curve.
pub(super) struct Curve {
    /// What was tried.
    pub name: String,
    /// Its values, in the unit of the axis; those that are not positive are drawn at the
    /// left edge, those that are not finite never.
    pub values: Vec<f64>,
    /// The paper's median or mean in that unit, if it has one.
    pub paper: Option<f64>,
}

impl Curve {
    /// A curve of distances, in centimetres.
    pub(super) fn cm(
        name: &str,
        distances_m: impl Iterator<Item = f64>,
        paper_cm: Option<f64>,
    ) -> Self {
        Self {
            name: name.to_owned(),
            values: distances_m.map(|m| 100.0 * m).collect(),
            paper: paper_cm,
        }
    }
}

/// Where the picture of a result file stands: `.svg` for `.json`, or after its name.
pub(super) fn beside(result: &Path) -> PathBuf {
    match result.extension() {
        Some(ending) if ending == "json" => result.with_extension("svg"),
        _ => PathBuf::from(format!("{}.svg", result.display())),
    }
}

/// Draws the curves of a result of this name over one axis of powers of ten, next
/// to the result file; nothing where there is none. `axis` is what is along it, with its
/// unit. Colours repeat beyond nine curves.
pub(super) fn write(
    out: Option<&Path>,
    name: &str,
    axis: &str,
    curves: &[Curve],
) -> Outcome<Option<PathBuf>> {
    let Some(path) = out.map(beside) else {
        return Ok(None);
    };
    let title = format!("{name}, version {VERSION}");
    let mut svg = String::new();
    draw(&mut svg, &title, axis, curves)
        .map_err(|e| anyhow!("picture `{}`: {e}", path.display()))
        .or_failed()?;
    files::write_atomic(&path, svg.as_bytes()).or_failed()?;
    Ok(Some(path))
}

/// Smallest and greatest value shown: whole powers of ten around the middle 98 %.
fn range(curves: &[Curve]) -> (f64, f64) {
    let finite = |v: &f64| v.is_finite() && *v > 0.0;
    let values = curves.iter().flat_map(|c| c.values.iter().chain(&c.paper));
    let mut sorted: Vec<f64> = values.copied().filter(finite).collect();
    sorted.sort_by(f64::total_cmp);
    let low = sorted.get(sorted.len() / 100).copied().unwrap_or(0.1);
    let high = sorted.last().copied().unwrap_or(10.0);
    let decade = |v: f64, up: bool| {
        let power = v.log10();
        10f64.powf(if up { power.ceil() } else { power.floor() })
    };
    let low = decade(low, false);
    (low, decade(high, true).max(10.0 * low))
}

fn draw(
    svg: &mut String,
    title: &str,
    axis: &str,
    curves: &[Curve],
) -> Result<(), Box<dyn core::error::Error>> {
    let (low, high) = range(curves);
    let area = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .caption(title, ("sans-serif", 18))
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d((low..high).log_scale(), 0.0..100.0)?;
    chart
        .configure_mesh()
        .x_desc(axis)
        .y_desc("fraction of the trials below (%)")
        .x_label_formatter(&|v| format!("{v}"))
        .draw()?;
    for (curve, colour) in curves.iter().zip(COLOURS.iter().cycle()) {
        chart
            .draw_series(LineSeries::new(
                steps(&curve.values, low, high),
                colour.stroke_width(2),
            ))?
            .label(curve.name.clone())
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
        if let Some(paper) = curve.paper {
            chart.draw_series(DashedLineSeries::new(
                [(paper, 0.0), (paper, 100.0)],
                5,
                4,
                colour.stroke_width(1),
            ))?;
        }
    }
    if curves.iter().any(|c| c.paper.is_some()) {
        chart
            .draw_series(core::iter::empty::<PathElement<(f64, f64)>>())?
            .label("dashed: the paper's")
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], WHITE));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .draw()?;
    area.present()?;
    Ok(())
}

/// The distribution of the values as stairs (%), between two limits.
fn steps(values: &[f64], low: f64, high: f64) -> Vec<(f64, f64)> {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| !v.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    let part = |count: usize| 100.0 * count as f64 / values.len().max(1) as f64;
    let mut points = vec![(low, 0.0)];
    for (before, value) in sorted.iter().enumerate().filter(|(_, v)| v.is_finite()) {
        let x = value.clamp(low, high);
        points.extend([(x, part(before)), (x, part(before + 1))]);
    }
    let last = points.last().map_or(0.0, |p| p.1);
    points.push((high, last));
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stairs_rise_at_the_values_and_end_below_all_where_some_are_lost() {
        let values = [2.0, 0.0, f64::INFINITY, 1.0];
        let points = steps(&values, 0.1, 10.0);
        assert_eq!(points[0], (0.1, 0.0));
        assert_eq!(points[2], (0.1, 25.0));
        assert_eq!(points[3..5], [(1.0, 25.0), (1.0, 50.0)]);
        assert_eq!(points[points.len() - 1], (10.0, 75.0));
    }

    #[test]
    fn a_picture_stands_beside_its_result_with_seed_and_names() {
        let dir = tempfile::tempdir().unwrap();
        let curves = [
            Curve {
                name: "true <parameters>".to_owned(),
                values: vec![0.02, 0.3, f64::NAN],
                paper: Some(1.2),
            },
            Curve {
                name: "nothing".to_owned(),
                values: Vec::new(),
                paper: None,
            },
        ];
        let axis = "distance of tip and target (cm)";
        let drawn = |out: Option<&Path>| write(out, "sim-pipeline, seed 7", axis, &curves).unwrap();
        assert_eq!(range(&curves), (0.01, 10.0));
        assert_eq!(drawn(None), None);
        let out = dir.path().join("result.json");
        let path = drawn(Some(&out)).unwrap();
        let svg = std::fs::read_to_string(&path).unwrap();
        assert_eq!(path, dir.path().join("result.svg"));
        for wanted in [
            "sim-pipeline, seed 7",
            "true &lt;parameters&gt;",
            "the paper",
            "(cm)",
        ] {
            assert!(svg.contains(wanted), "{wanted}");
        }
    }
}
