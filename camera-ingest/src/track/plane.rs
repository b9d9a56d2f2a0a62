//! The plane in which the rope swings.
//!
//! A wiggle moves the rope in one vertical plane (within 1-2 cm). What is measured in
//! metres lies on it: x to the right as the camera sees it, y
//! down. Lens distortion and perspective are thereby dealt with in one place,
//! and lengths along the rope are true lengths.

use nalgebra::{Matrix2, Vector3};
use rope_sim::AttachMotion;
use shared_types::{Intrinsics, StereoCamera};

/// A point or displacement on the rope's plane (m).
pub(super) type Point = [f64; 2];

/// Ways of the clamp shorter than this say nothing about the plane (m, std).
const MIN_SPREAD_M: f64 = 0.005;
/// A plane seen flatter than this is of no use (cosine of the angle between
/// the camera's view and the plane's normal).
const MIN_FACING: f64 = 0.35;

/// Map from raw left-eye pixels to the plane (m).
#[derive(Debug, Clone)]
pub(super) struct RopePlane {
    image: Intrinsics,
    /// Origin and axes in the left optical frame.
    origin_c: Vector3<f64>,
    right_c: Vector3<f64>,
    down_c: Vector3<f64>,
    normal_c: Vector3<f64>,
    /// Pixels per metre at the origin.
    pub(super) px_per_m: f64,
}

impl RopePlane {
    /// Plane through the clamp at t = 0, along the clamp's main horizontal
    /// motion until `until_s`; facing the camera if the clamp hardly moves.
    /// `None` when the clamp is behind the camera.
    pub(super) fn fit(
        camera: &StereoCamera,
        clamp: &dyn AttachMotion,
        until_s: f64,
    ) -> Option<Self> {
        let view_w = camera.r_w_cam.column(2).into_owned();
        let facing = camera.r_w_cam.column(0).into_owned();
        let right_w = main_direction(clamp, until_s)
            .map(|d| if d.dot(&facing) < 0.0 { -d } else { d })
            .filter(|d| d.cross(&Vector3::z()).dot(&view_w).abs() > MIN_FACING)
            .or_else(|| horizontal(&facing))?;
        let origin_c = camera.to_left(&clamp.at(0.0).p_m);
        if origin_c.z < 0.05 {
            return None;
        }
        let to_camera = |v: Vector3<f64>| camera.r_w_cam.tr_mul(&v);
        let (right_c, down_c) = (to_camera(right_w), to_camera(-Vector3::z()));
        Some(Self {
            image: camera.left,
            normal_c: right_c.cross(&down_c),
            px_per_m: camera.left.fx.midpoint(camera.left.fy) / origin_c.z,
            origin_c,
            right_c,
            down_c,
        })
    }

    /// Point of the plane seen at a raw pixel.
    pub(super) fn point_at(&self, pixel: [f64; 2]) -> Point {
        let [x, y] = self.image.undistort(pixel);
        let ray = Vector3::new(x, y, 1.0);
        let along = self.normal_c.dot(&ray);
        let depth = self.normal_c.dot(&self.origin_c) / along;
        let p = ray * depth - self.origin_c;
        [p.dot(&self.right_c), p.dot(&self.down_c)]
    }
}

fn horizontal(v: &Vector3<f64>) -> Option<Vector3<f64>> {
    Vector3::new(v.x, v.y, 0.0).try_normalize(1e-3)
}

/// Horizontal direction in which the clamp moves most.
fn main_direction(clamp: &dyn AttachMotion, until_s: f64) -> Option<Vector3<f64>> {
    const SAMPLES: u32 = 200;
    let points: Vec<Vector3<f64>> = (0..=SAMPLES)
        .map(|i| clamp.at(until_s * f64::from(i) / f64::from(SAMPLES)).p_m)
        .collect();
    let count = f64::from(SAMPLES + 1);
    let mean = points.iter().sum::<Vector3<f64>>() / count;
    let spread = points.iter().fold(Matrix2::zeros(), |sum, p| {
        let d = (p - mean).xy();
        sum + d * d.transpose()
    }) / count;
    let eigen = spread.symmetric_eigen();
    let main = eigen.eigenvalues.imax();
    (eigen.eigenvalues[main].max(0.0).sqrt() > MIN_SPREAD_M).then(|| {
        let d = eigen.eigenvectors.column(main);
        Vector3::new(d[0], d[1], 0.0)
    })
}
