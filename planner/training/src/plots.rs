//! Plots: losses over the steps, predicted against true parameters.

use crate::error::{Result, TrainingError};
use crate::files::write_whole;
use crate::metrics::Metric;
use plotters::coord::Shift;
use plotters::prelude::*;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use std::path::Path;

type Drawn = core::result::Result<(), Box<dyn core::error::Error>>;

/// Draws the losses of training and held-out films over the steps.
pub(crate) fn plot_losses(path: &Path, metrics: &[Metric]) -> Result<()> {
    let trained: Vec<(f64, f64)> = metrics.iter().map(|m| (m.step as f64, m.loss)).collect();
    let held_out: Vec<(f64, f64)> = metrics
        .iter()
        .filter_map(|m| m.held_out.map(|(loss, _)| (m.step as f64, loss)))
        .collect();
    let all = || trained.iter().chain(&held_out).map(|p| p.1);
    let low = all().fold(f64::INFINITY, f64::min).clamp(1e-6, 1.0) * 0.9;
    let high = all().fold(0.0, f64::max).max(low * 1.5) * 1.1;
    let last = trained.last().map_or(1.0, |p| p.0).max(1.0);
    plot(path, (900, 500), |area| {
        let mut chart = ChartBuilder::on(area)
            .margin(16)
            .caption(
                "mean squared error of normalised parameters",
                ("sans-serif", 18),
            )
            .x_label_area_size(36)
            .y_label_area_size(60)
            .build_cartesian_2d(0.0..last, (low..high).log_scale())?;
        chart.configure_mesh().x_desc("step").draw()?;
        for (points, colour, name) in [
            (&trained, &BLUE, "training films"),
            (&held_out, &RED, "held-out films"),
        ] {
            let line = LineSeries::new(points.iter().copied(), colour);
            chart
                .draw_series(line)?
                .label(name)
                .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], colour));
        }
        chart
            .configure_series_labels()
            .background_style(WHITE)
            .border_style(BLACK)
            .draw()?;
        Ok(())
    })
}

/// Draws predicted over true values, one panel per parameter; the values are parts
/// of their ranges.
pub(crate) fn plot_predictions(
    path: &Path,
    pairs: &[([f64; ROPE_PARAMETERS], [f64; ROPE_PARAMETERS])],
) -> Result<()> {
    plot(path, (960, 960), |area| {
        for (i, panel) in area.split_evenly((3, 3)).iter().enumerate() {
            let mut chart = ChartBuilder::on(panel)
                .margin(10)
                .caption(RANGES[i].label, ("sans-serif", 16))
                .x_label_area_size(24)
                .y_label_area_size(30)
                .build_cartesian_2d(0.0..1.0, 0.0..1.0)?;
            chart.configure_mesh().x_labels(3).y_labels(3).draw()?;
            chart.draw_series(LineSeries::new([(0.0, 0.0), (1.0, 1.0)], &BLACK))?;
            let dots = pairs
                .iter()
                .map(|(truth, found)| Circle::new((truth[i], found[i]), 1, BLUE.mix(0.5).filled()));
            chart.draw_series(dots)?;
        }
        Ok(())
    })
}

/// Draws into an SVG file of this size.
fn plot(
    path: &Path,
    size: (u32, u32),
    draw: impl FnOnce(&DrawingArea<SVGBackend<'_>, Shift>) -> Drawn,
) -> Result<()> {
    let mut svg = String::new();
    let drawn = || -> Drawn {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE)?;
        draw(&area)?;
        Ok(area.present()?)
    };
    drawn().map_err(|e| TrainingError::Failed(format!("plot {}: {e}", path.display())))?;
    write_whole(path, svg.as_bytes())
}
