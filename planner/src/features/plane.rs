//! The vertical plane in which the arm wiggles, and pixels cast onto it.

use super::alignment::Sway;
use super::definition::ObserveError;
use nalgebra::{Matrix3, Vector3};
use rope_sim::AttachMotion;
use shared_types::StereoCamera;

/// Smallest angle between view and plane (degrees).
const ANGLE_MIN_DEGREES: f64 = 30.0;
/// Least sideways way of a clamp that wiggles (m).
const WAY_MIN_M: f64 = 0.01;

/// A vertical plane: forward is the horizontal direction in it; and how the clamp
/// sways in it.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewPlane {
    /// A point of the plane (world, m).
    pub origin_m: Vector3<f64>,
    /// Horizontal unit vector in the plane, away from the arm's base.
    pub forward: Vector3<f64>,
    pub(super) sway: Sway,
}

impl ViewPlane {
    /// The plane in which the clamp sways most during the first `duration_s`.
    ///
    /// # Errors
    /// A clamp that hardly moves sideways.
    pub fn of_motion(motion: &dyn AttachMotion, duration_s: f64) -> Result<Self, ObserveError> {
        const SAMPLES: u32 = 1500;
        let period_s = duration_s / f64::from(SAMPLES);
        let places: Vec<Vector3<f64>> = (0..=SAMPLES)
            .map(|i| {
                let t_s = period_s * f64::from(i);
                motion.at(t_s.min(motion.duration_s())).p_m
            })
            .collect();
        let mean = places.iter().sum::<Vector3<f64>>() / f64::from(SAMPLES + 1);
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        for place in &places {
            let d = place - mean;
            xx += d.x * d.x;
            xy += d.x * d.y;
            yy += d.y * d.y;
        }
        // Direction of the larger principal axis of the horizontal way.
        let bearing = 0.5 * (2.0 * xy).atan2(xx - yy);
        let axis = Vector3::new(bearing.cos(), bearing.sin(), 0.0);
        let forward = if axis.dot(&mean) < 0.0 { -axis } else { axis };
        let ways = places.iter().map(|p| (p - mean).dot(&forward));
        let (low, high) = ways.fold((0.0_f64, 0.0_f64), |(l, h), w| (l.min(w), h.max(w)));
        if high - low < WAY_MIN_M {
            return Err(ObserveError::new(format!(
                "the clamp moves {:.1} mm sideways, at least {} mm make a wiggle",
                (high - low) * 1e3,
                WAY_MIN_M * 1e3
            )));
        }
        let forward_m = places.iter().map(|p| (p - mean).dot(&forward)).collect();
        Ok(Self {
            origin_m: mean,
            forward,
            sway: Sway {
                period_s,
                forward_m,
            },
        })
    }

    /// The plane as a camera sees it.
    pub(super) fn seen_from(&self, camera: &StereoCamera) -> Result<PlaneView, ObserveError> {
        let up = Vector3::z();
        let normal = self.forward.cross(&up);
        let axis = camera.r_w_cam.column(2).into_owned();
        let degrees = axis.dot(&normal).abs().min(1.0).asin().to_degrees();
        let edge_on = || {
            ObserveError::new(format!(
                "the camera looks at the plane of the wiggle from {degrees:.0} degrees, at least {ANGLE_MIN_DEGREES} are needed: film it from the side"
            ))
        };
        if degrees < ANGLE_MIN_DEGREES {
            return Err(edge_on());
        }
        // A point a forward + b up of the plane is at R^T (origin + ... - camera);
        // the inverse of these columns casts a ray back onto (a, b, 1).
        let columns = Matrix3::from_columns(&[self.forward, up, self.origin_m - camera.p_w_cam_m]);
        let cast = (camera.r_w_cam.transpose() * columns).try_inverse();
        cast.map(|cast| PlaneView { cast }).ok_or_else(edge_on)
    }
}

/// The way from normalised image points to the plane.
pub(super) struct PlaneView {
    cast: Matrix3<f64>,
}

impl PlaneView {
    /// Forward and up of the point of the plane behind a normalised image point
    /// (m); `None` where the ray meets the plane behind the camera.
    pub(super) fn point(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let p = self.cast * Vector3::new(x, y, 1.0);
        (p.z > 1e-6).then(|| [p.x / p.z, p.y / p.z])
    }
}
