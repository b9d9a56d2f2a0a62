//! How thick rope and lead look, in metres.
//!
//! Coverage summed across the rope is its width whatever the blur, since
//! blurring moves coverage about without changing its sum.

use super::curve::{add, normals, scale};
use super::evidence::{Coverage, Matter};
use super::follow::NODES;
use super::plane::{Point, RopePlane};
use crate::frame::{EyeFrame, rgb_from_ycc};

/// What the rope looks like while it hangs still.
#[derive(Debug, Clone, PartialEq)]
pub struct RopeAppearance {
    /// Half the rope's apparent width (m).
    pub rope_radius_m: f64,
    /// Radius of the disc with the lead's apparent area (m).
    pub lead_radius_m: f64,
    /// Length from clamp to lead centre (m).
    pub length_m: f64,
    /// Median colour of the rope.
    pub rope_rgb: [u8; 3],
    /// Median colour of the lead.
    pub lead_rgb: [u8; 3],
    /// Typical distance of a still pixel from the background (grey levels).
    pub noise: f32,
}

/// Half the median width of the rope along a curve (m).
pub(super) fn rope_radius_m(
    curve: &[Point],
    plane: &RopePlane,
    coverage: &Coverage,
) -> Option<f64> {
    const STEP_PX: f64 = 0.25;
    const REACH: i32 = 24;
    let step_m = STEP_PX / plane.px_per_m;
    let mut widths: Vec<f64> = curve
        .iter()
        .zip(normals(curve))
        .enumerate()
        .filter(|(i, _)| (NODES / 6..NODES * 3 / 4).contains(i))
        .map(|(_, (p, n))| {
            (-REACH..=REACH)
                .map(|k| {
                    let at = add(*p, scale(n, f64::from(k) * step_m));
                    f64::from(coverage.at(plane.to_pixel(at))).min(1.0) * step_m
                })
                .sum()
        })
        .collect();
    if widths.is_empty() {
        return None;
    }
    let middle = widths.len() / 2;
    let width = *widths.select_nth_unstable_by(middle, f64::total_cmp).1;
    (width > 0.0).then_some(width / 2.0)
}

/// Radius of the disc with the area that the lead covers (m).
pub(super) fn lead_radius_m(
    frame: &EyeFrame,
    matter: &Matter<'_>,
    centre_px: [f64; 2],
    guess_px: f64,
    plane: &RopePlane,
) -> f64 {
    let window =
        super::evidence::Window::around(std::iter::once(centre_px), 2.0 * guess_px + 4.0, frame);
    let coverage = matter.coverage(frame, window);
    let mut radius_px = guess_px;
    for _ in 0..3 {
        let (area, _) = coverage.centroid(centre_px, radius_px + 1.5);
        radius_px = (area / std::f64::consts::PI)
            .sqrt()
            .clamp(1.0, 2.0 * guess_px);
    }
    radius_px / plane.px_per_m
}

pub(super) fn rgb(colour: [f32; 3]) -> [u8; 3] {
    rgb_from_ycc(colour)
}
