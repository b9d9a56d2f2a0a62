//! How thick rope and lead look, in metres.
//!
//! Edges are where the contrast against the background is half of the inside's:
//! a blur as wide as the rope or less leaves that place where it was.

use super::curve::{add, normals, scale};
use super::follow::NODES;
use super::outline::Contrast;
use super::plane::{Point, RopePlane};

/// Ropes are thinner than this (radius, m).
const WIDEST_ROPE_M: f64 = 0.015;

/// What the rope looks like while it hangs still.
#[derive(Debug, Clone, PartialEq)]
pub struct RopeAppearance {
    /// Half the rope's apparent width (m).
    pub rope_radius_m: f64,
    /// Radius of the lead's outline (m).
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

/// Half the rope's width (m): contrast across the curve, squared and averaged
/// along it, falls to half on the rope's edges. Averaging squares lets stretches
/// with little contrast count little; what the noise adds to them is seen
/// beside the rope and taken off.
pub(super) fn rope_radius_m(
    curve: &[Point],
    plane: &RopePlane,
    contrast: &Contrast<'_>,
) -> Option<f64> {
    const STEP_PX: f64 = 0.25;
    // The profile reaches well beyond the widest rope.
    let reach = (2.2 * WIDEST_ROPE_M * plane.px_per_m / STEP_PX).ceil() as usize;
    let step_m = STEP_PX / plane.px_per_m;
    let across = normals(curve);
    let nodes = NODES / 6..NODES * 5 / 6;
    let mean_square = |lane: usize| -> f64 {
        let offset = (lane as f64 - reach as f64) * step_m;
        let squares = nodes.clone().map(|i| {
            let at = plane.to_pixel(add(curve[i], scale(across[i], offset)));
            contrast.at(at).powi(2)
        });
        squares.sum::<f64>() / nodes.len() as f64
    };
    let squares: Vec<f64> = (0..=2 * reach).map(mean_square).collect();
    // A shadow may lie on one side: the quieter end is the noise.
    let end = reach / 4;
    let level = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let noise = level(&squares[..end]).min(level(&squares[squares.len() - end..]));
    let profile: Vec<f64> = squares
        .iter()
        .map(|s| (s - noise).max(0.0).sqrt())
        .collect();
    let peak = (reach - 4..=reach + 4).max_by(|&a, &b| profile[a].total_cmp(&profile[b]))?;
    let half = profile[peak] / 2.0;
    if half <= f64::from(contrast.background.noise) {
        return None;
    }
    let edge = |direction: isize| -> Option<f64> {
        let (mut at, mut steps) = (peak, 0.0);
        loop {
            let next = at.checked_add_signed(direction)?;
            let (here, there) = (profile[at], *profile.get(next)?);
            if there < half {
                return Some(steps + (here - half) / (here - there).max(1e-9));
            }
            (at, steps) = (next, steps + 1.0);
        }
    };
    Some((edge(-1)? + edge(1)?) * step_m / 2.0)
}
