//! Geometry of a stereo camera: pinhole with Brown distortion, misaligned
//! eyes, global or rolling shutter.
//!
//! Camera frames: x right, y down, z forward (optical frame). Pixels are raw
//! (distorted) pixels, integer coordinates at pixel centres. The right eye sees
//! `X_right = R X_left - t`, the convention of the factory calibration files.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// Pinhole intrinsics with five distortion coefficients (OpenCV's order).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Intrinsics {
    /// Focal length along u (px).
    pub fx: f64,
    /// Focal length along v (px).
    pub fy: f64,
    /// Principal point, u (px).
    pub cx: f64,
    /// Principal point, v (px).
    pub cy: f64,
    /// Distortion `k1, k2, p1, p2, k3`.
    pub distortion: [f64; 5],
}

impl Intrinsics {
    /// Raw pixel of a normalised image point `(x/z, y/z)`.
    #[must_use]
    pub fn distort(&self, x: f64, y: f64) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = x * x + y * y;
        let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
        let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
        [self.fx * xd + self.cx, self.fy * yd + self.cy]
    }

    /// Normalised image point of a raw pixel: fixed-point inverse of
    /// [`Intrinsics::distort`], iterated to convergence.
    #[must_use]
    pub fn undistort(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let (x0, y0) = ((u - self.cx) / self.fx, (v - self.cy) / self.fy);
        let (mut x, mut y) = (x0, y0);
        for _ in 0..100 {
            let r2 = x * x + y * y;
            let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
            let dx = 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
            let dy = p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
            let (xn, yn) = ((x0 - dx) / radial, (y0 - dy) / radial);
            let moved = (xn - x).abs() + (yn - y).abs();
            (x, y) = (xn, yn);
            if moved < 1e-13 {
                break;
            }
        }
        [x, y]
    }

    /// Raw pixel of a point in this eye's frame (m); `None` behind the camera.
    #[must_use]
    pub fn project(&self, p_c_m: &Vector3<f64>) -> Option<[f64; 2]> {
        (p_c_m.z > 1e-6).then(|| self.distort(p_c_m.x / p_c_m.z, p_c_m.y / p_c_m.z))
    }
}

/// When the rows of a frame are exposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shutter {
    /// All rows together.
    Global,
    /// Row by row, top first.
    Rolling,
}

/// A calibrated stereo camera at a known place in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StereoCamera {
    /// Pixels per row of one eye.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Left eye.
    pub left: Intrinsics,
    /// Right eye.
    pub right: Intrinsics,
    /// Rotation R of `X_right = R X_left - t`.
    pub r_right_left: Matrix3<f64>,
    /// Offset t of `X_right = R X_left - t` (m).
    pub t_right_left_m: Vector3<f64>,
    /// Attitude of the left optical frame, camera to world.
    pub r_w_cam: Matrix3<f64>,
    /// Position of the left optical centre in the world (m).
    pub p_w_cam_m: Vector3<f64>,
    /// Shutter kind.
    pub shutter: Shutter,
    /// Exposure time of a row (s).
    pub exposure_s: f64,
    /// Time from one row to the next, 0 for a global shutter (s).
    pub line_time_s: f64,
}

/// A 3D point found from both eyes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triangulated {
    /// Point in the world (m).
    pub p_w_m: Vector3<f64>,
    /// Shortest distance between the two rays (m).
    pub gap_m: f64,
}

impl StereoCamera {
    /// World point in the left optical frame (m).
    #[must_use]
    pub fn to_left(&self, p_w_m: &Vector3<f64>) -> Vector3<f64> {
        self.r_w_cam.tr_mul(&(p_w_m - self.p_w_cam_m))
    }

    /// Raw left-eye pixel of a world point; `None` behind the camera.
    #[must_use]
    pub fn project_left(&self, p_w_m: &Vector3<f64>) -> Option<[f64; 2]> {
        self.left.project(&self.to_left(p_w_m))
    }

    /// Raw right-eye pixel of a world point; `None` behind the camera.
    #[must_use]
    pub fn project_right(&self, p_w_m: &Vector3<f64>) -> Option<[f64; 2]> {
        let p_right_m = self.r_right_left * self.to_left(p_w_m) - self.t_right_left_m;
        self.right.project(&p_right_m)
    }

    /// Whether a raw pixel lies inside the image.
    #[must_use]
    pub fn contains(&self, [u, v]: [f64; 2]) -> bool {
        u >= 0.0
            && v >= 0.0
            && u <= f64::from(self.width_px) - 1.0
            && v <= f64::from(self.height_px) - 1.0
    }

    /// Time from the frame's start to the middle of the exposure of row `v` (s).
    #[must_use]
    pub fn row_time_s(&self, v: f64) -> f64 {
        self.exposure_s / 2.0 + self.line_time_s * v.clamp(0.0, f64::from(self.height_px))
    }

    /// Time from the start of the first row's exposure to the end of the last one's (s).
    #[must_use]
    pub fn frame_time_s(&self) -> f64 {
        self.exposure_s + self.line_time_s * f64::from(self.height_px.saturating_sub(1))
    }

    /// Ray through a raw left pixel in the world: (origin in m, unit direction).
    #[must_use]
    pub fn left_ray(&self, pixel: [f64; 2]) -> (Vector3<f64>, Vector3<f64>) {
        let [x, y] = self.left.undistort(pixel);
        (
            self.p_w_cam_m,
            (self.r_w_cam * Vector3::new(x, y, 1.0)).normalize(),
        )
    }

    /// Ray through a raw right pixel in the world: (origin in m, unit direction).
    fn right_ray(&self, pixel: [f64; 2]) -> (Vector3<f64>, Vector3<f64>) {
        let [x, y] = self.right.undistort(pixel);
        let to_world = self.r_w_cam * self.r_right_left.transpose();
        let origin = self.p_w_cam_m + to_world * self.t_right_left_m;
        (origin, (to_world * Vector3::new(x, y, 1.0)).normalize())
    }

    /// Point nearest to the rays of a raw pixel pair; `None` for parallel rays.
    #[must_use]
    pub fn triangulate(&self, left: [f64; 2], right: [f64; 2]) -> Option<Triangulated> {
        let ((o1, d1), (o2, d2)) = (self.left_ray(left), self.right_ray(right));
        let w = o1 - o2;
        let (b, d, e) = (d1.dot(&d2), d1.dot(&w), d2.dot(&w));
        let det = 1.0 - b * b;
        if det < 1e-12 {
            return None;
        }
        let (s, t) = ((b * e - d) / det, (e - b * d) / det);
        let (p, q) = (o1 + d1 * s, o2 + d2 * t);
        Some(Triangulated {
            p_w_m: (p + q) / 2.0,
            gap_m: (p - q).norm(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(crate) fn example() -> StereoCamera {
        let image = Intrinsics {
            fx: 350.9,
            fy: 350.2,
            cx: 340.1,
            cy: 190.3,
            distortion: [-0.175, 0.028, 4e-4, -3e-4, -0.002],
        };
        StereoCamera {
            width_px: 672,
            height_px: 376,
            left: image,
            right: Intrinsics { cx: 333.0, ..image },
            r_right_left: *nalgebra::Rotation3::new(Vector3::new(-9e-4, 6e-3, 1e-3)).matrix(),
            t_right_left_m: Vector3::new(0.063, 1e-4, -2e-4),
            r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
            p_w_cam_m: Vector3::new(0.6, -1.2, 0.2),
            shutter: Shutter::Rolling,
            exposure_s: 0.004,
            line_time_s: 26e-6,
        }
    }

    #[test]
    fn undistort_inverts_distort_to_the_corners() {
        let image = example().left;
        for u in (0..672).step_by(61) {
            for v in (0..376).step_by(47) {
                let [x, y] = image.undistort([f64::from(u), f64::from(v)]);
                let back = image.distort(x, y);
                assert!((back[0] - f64::from(u)).hypot(back[1] - f64::from(v)) < 1e-6);
            }
        }
    }

    #[test]
    fn triangulation_closes_on_projected_points() {
        let cam = example();
        for p in [[0.6, 0.0, 0.2], [1.1, 0.2, 0.5], [0.2, -0.1, -0.3]] {
            let p = Vector3::from(p);
            let found = cam
                .triangulate(
                    cam.project_left(&p).unwrap(),
                    cam.project_right(&p).unwrap(),
                )
                .unwrap();
            assert!((found.p_w_m - p).norm() < 1e-8 && found.gap_m < 1e-8);
        }
    }

    #[test]
    fn a_point_behind_the_camera_has_no_pixel() {
        assert!(
            example()
                .project_left(&Vector3::new(0.6, -2.0, 0.2))
                .is_none()
        );
    }
}
