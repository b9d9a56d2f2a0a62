//! One eye of the stereo camera: from the world to raw pixels and depth.

use nalgebra::{Matrix3, Vector3};
use shared_types::{Intrinsics, StereoCamera};

/// One eye of a stereo camera at its place in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ImageView {
    intrinsics: Intrinsics,
    r_cam_w: Matrix3<f64>,
    t_cam_m: Vector3<f64>,
    width_px: u32,
    height_px: u32,
}

/// Where a point appears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seen {
    /// Raw pixel.
    pub(super) pixel: [f64; 2],
    /// Distance along the optical axis (m).
    pub(super) depth_m: f64,
    /// Pixels per metre of a small thing there, facing the camera.
    pub(super) px_per_m: f64,
}

impl ImageView {
    /// Left eye.
    pub(super) fn left(camera: &StereoCamera) -> Self {
        let r_cam_w = camera.r_w_cam.transpose();
        Self {
            intrinsics: camera.left,
            r_cam_w,
            t_cam_m: -r_cam_w * camera.p_w_cam_m,
            width_px: camera.width_px,
            height_px: camera.height_px,
        }
    }

    /// Right eye.
    pub(super) fn right(camera: &StereoCamera) -> Self {
        let left = Self::left(camera);
        Self {
            intrinsics: camera.right,
            r_cam_w: camera.r_right_left * left.r_cam_w,
            t_cam_m: camera.r_right_left * left.t_cam_m - camera.t_right_left_m,
            ..left
        }
    }

    /// Columns and rows of this eye's picture.
    pub(super) fn size_px(&self) -> (usize, usize) {
        (self.width_px as usize, self.height_px as usize)
    }

    /// Raw pixel of a world point; `None` behind the camera.
    pub(super) fn project(&self, p_w_m: &Vector3<f64>) -> Option<[f64; 2]> {
        self.see(p_w_m).map(|seen| seen.pixel)
    }

    /// A direction in the world as this eye sees it: right, down, ahead.
    pub(super) fn turned(&self, way: &Vector3<f64>) -> Vector3<f64> {
        self.r_cam_w * way
    }

    /// Raw pixel, depth and scale of a world point; `None` if nearer than 5 cm
    /// to the camera's plane or far outside the lens's field, where distortion
    /// polynomials fold back.
    pub(super) fn see(&self, p_w_m: &Vector3<f64>) -> Option<Seen> {
        const PROBE: f64 = 1e-3;
        let p = self.r_cam_w * p_w_m + self.t_cam_m;
        let (x, y) = (p.x / p.z, p.y / p.z);
        if p.z < 0.05 || x.abs() > 1.6 || y.abs() > 1.3 {
            return None;
        }
        let at = self.intrinsics.distort(x, y);
        let (right, down) = (
            self.intrinsics.distort(x + PROBE, y),
            self.intrinsics.distort(x, y + PROBE),
        );
        // Area scale of the lens at this place, as a length.
        let area = (right[0] - at[0]) * (down[1] - at[1]) - (right[1] - at[1]) * (down[0] - at[0]);
        Some(Seen {
            pixel: at,
            depth_m: p.z,
            px_per_m: area.abs().sqrt() / PROBE / p.z,
        })
    }

    /// Origin (m) and direction in the world of the ray through a raw pixel.
    pub(super) fn ray(&self, pixel: [f64; 2]) -> (Vector3<f64>, Vector3<f64>) {
        let [x, y] = self.intrinsics.undistort(pixel);
        (
            -self.r_cam_w.tr_mul(&self.t_cam_m),
            self.r_cam_w.tr_mul(&Vector3::new(x, y, 1.0)),
        )
    }
}

/// Brightness of the lens towards its corners, relative to the centre.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vignette {
    centre: [f32; 2],
    per_px2: f32,
}

impl Vignette {
    /// A lens that loses this part of the light in the corners.
    pub(super) fn of(image: &ImageView, corner_loss: f32) -> Self {
        let (w, h) = image.size_px();
        let centre = [w as f32 / 2.0, h as f32 / 2.0];
        Self {
            centre,
            per_px2: corner_loss / (centre[0] * centre[0] + centre[1] * centre[1]),
        }
    }

    /// Factor at a pixel.
    pub(super) fn at(&self, u: f32, v: f32) -> f32 {
        let (du, dv) = (u - self.centre[0], v - self.centre[1]);
        1.0 - self.per_px2 * (du * du + dv * dv)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraConfig;

    #[test]
    fn eyes_agree_with_the_stereo_camera_and_their_own_rays() {
        let camera = CameraConfig::default().stereo_camera();
        for p in [[0.6, 0.0, 0.2], [1.1, 0.2, 0.5], [0.2, -0.1, -0.3]] {
            let p = Vector3::from(p);
            for (image, want) in [
                (ImageView::left(&camera), camera.project_left(&p).unwrap()),
                (ImageView::right(&camera), camera.project_right(&p).unwrap()),
            ] {
                let got = image.project(&p).unwrap();
                assert!((got[0] - want[0]).hypot(got[1] - want[1]) < 1e-9);
                let (o, d) = image.ray(got);
                assert!((p - o).cross(&d.normalize()).norm() < 1e-9);
            }
        }
    }
}
