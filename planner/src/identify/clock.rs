//! Offset between the clocks of arm and camera, from the clamp alone.
//!
//! The clamp moves as the arm says, whatever the rope: the offset that makes its
//! keypoint and its projection move together needs no rope simulation. A constant
//! distance between the two (a clamp that hides the first millimetres of rope)
//! does not matter.

use rope_sim::AttachMotion;
use shared_types::StereoCamera;

/// What the clamp tells about the clocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ClockWindow {
    /// Camera time minus motion time (s).
    pub(super) offset_s: f64,
    /// Half width within which the fit may correct it (s).
    pub(super) half_width_s: f64,
}

/// Way of the clamp in the picture below which it tells nothing (px, root mean
/// square).
const MOTION_MIN_PX: f64 = 3.0;
/// Half width left to the fit where the clamp was seen moving (s).
const HALF_WIDTH_S: f64 = 0.03;

/// Finds the offset within `max_s` from where the clamp was seen: camera times (s) and
/// raw left-image pixels.
pub(super) fn clock_window(
    clamp: &[(f64, [f64; 2])],
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    max_s: f64,
) -> ClockWindow {
    let unknown = ClockWindow {
        offset_s: 0.0,
        half_width_s: max_s,
    };
    let seen: Vec<[f64; 2]> = clamp.iter().map(|(_, pixel)| *pixel).collect();
    if clamp.len() < 20 || variance(&seen) < MOTION_MIN_PX * MOTION_MIN_PX {
        return unknown;
    }
    // Variance of the distance between seen and projected clamp (px²).
    let spread = |offset_s: f64| {
        let apart = |(time_s, pixel): &(f64, [f64; 2])| {
            let [u, v] = camera.project_left(&motion.at(time_s - offset_s).p_m)?;
            Some([u - pixel[0], v - pixel[1]])
        };
        let apart: Option<Vec<[f64; 2]>> = clamp.iter().map(apart).collect();
        apart.map_or(f64::INFINITY, |a| variance(&a))
    };
    let mut best = (f64::INFINITY, 0.0);
    let mut step_s = max_s / 16.0;
    for k in -16..=16 {
        let offset_s = f64::from(k) * step_s;
        let s = spread(offset_s);
        if s < best.0 {
            best = (s, offset_s);
        }
    }
    while step_s > 1e-5 {
        step_s /= 2.0;
        for offset_s in [best.1 - step_s, best.1 + step_s] {
            let s = spread(offset_s);
            if s < best.0 && offset_s.abs() <= max_s {
                best = (s, offset_s);
            }
        }
    }
    if !best.0.is_finite() {
        return unknown;
    }
    ClockWindow {
        offset_s: best.1,
        half_width_s: HALF_WIDTH_S.min(max_s),
    }
}

fn variance(points: &[[f64; 2]]) -> f64 {
    let n = points.len() as f64;
    (0..2)
        .map(|axis| {
            let mean = points.iter().map(|p| p[axis]).sum::<f64>() / n;
            points.iter().map(|p| (p[axis] - mean).powi(2)).sum::<f64>() / n
        })
        .sum()
}
