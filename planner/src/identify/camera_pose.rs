//! A small error of the camera's place, fitted along with the rope.
//!
//! Six numbers: the camera's position (m) and the point it looks at, both along its
//! own axes, and its roll. An error of the position alone shows as parallax only, one
//! of the point looked at as a shift of the picture: as people mount cameras, these
//! are independent, and position and rotation are not.

use nalgebra::{Matrix3, Rotation3, Vector3};
use shared_types::StereoCamera;

/// Corrections: position x, y, z (m), point looked at x, y (m), roll (rad).
pub(super) const CORRECTIONS: usize = 6;

/// A camera whose place may be corrected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Viewer<'a> {
    camera: &'a StereoCamera,
    /// Distance of the point looked at (m).
    depth_m: f64,
}

/// A corrected place, ready to project.
#[derive(Debug, Clone, Copy)]
pub(super) struct View<'a> {
    camera: &'a StereoCamera,
    /// World to corrected camera frame.
    rotation: Matrix3<f64>,
    position_m: Vector3<f64>,
}

impl<'a> Viewer<'a> {
    /// A camera that looks at things near `p_w_m`.
    pub(super) fn new(camera: &'a StereoCamera, p_w_m: &Vector3<f64>) -> Self {
        Self {
            camera,
            depth_m: camera.to_left(p_w_m).z.max(0.1),
        }
    }

    /// Distance of the point looked at (m).
    pub(super) fn depth_m(&self) -> f64 {
        self.depth_m
    }

    /// Size of a pixel at the point looked at (m).
    pub(super) fn pixel_m(&self) -> f64 {
        self.depth_m / (self.camera.left.fx * self.camera.left.fy).sqrt()
    }

    /// Turn of the camera in its own frame that a correction means (rad).
    fn turn_rad(&self, c: &[f64; CORRECTIONS]) -> [f64; 3] {
        [
            (c[1] - c[4]) / self.depth_m,
            (c[3] - c[0]) / self.depth_m,
            c[5],
        ]
    }

    /// Position (m, world) and turn (rotation vector, rad, camera frame) of a
    /// correction.
    pub(super) fn moved(&self, c: &[f64; CORRECTIONS]) -> ([f64; 3], [f64; 3]) {
        let moved = self.camera.r_w_cam * Vector3::new(c[0], c[1], c[2]);
        (moved.into(), self.turn_rad(c))
    }

    /// The camera after a correction.
    pub(super) fn view(&self, c: &[f64; CORRECTIONS]) -> View<'a> {
        let turn = Rotation3::new(Vector3::from(self.turn_rad(c)));
        View {
            camera: self.camera,
            rotation: (self.camera.r_w_cam * turn.matrix()).transpose(),
            position_m: self.camera.p_w_cam_m
                + self.camera.r_w_cam * Vector3::new(c[0], c[1], c[2]),
        }
    }

    /// The cameras at a correction that is moved by `step` along each of its six numbers.
    pub(super) fn perturbed(&self, c: &[f64; CORRECTIONS], step: f64) -> [View<'a>; CORRECTIONS] {
        core::array::from_fn(|i| {
            let mut moved = *c;
            moved[i] += step;
            self.view(&moved)
        })
    }
}

impl View<'_> {
    /// Raw left-image pixel of a world point; `None` behind the camera.
    pub(super) fn project(&self, p_w_m: &Vector3<f64>) -> Option<[f64; 2]> {
        self.camera
            .left
            .project(&(self.rotation * (p_w_m - self.position_m)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic::side_camera;

    #[test]
    fn no_correction_changes_no_pixel() {
        let camera = side_camera();
        let p = Vector3::new(0.7, 0.0, 0.1);
        let viewer = Viewer::new(&camera, &p);
        let [u, v] = viewer.view(&[0.0; 6]).project(&p).unwrap();
        let [u0, v0] = camera.project_left(&p).unwrap();
        assert!((u - u0).hypot(v - v0) < 1e-9);
    }

    /// The camera moves aside and still looks at the same point: that point stays.
    #[test]
    fn the_point_looked_at_stays_when_only_the_position_changes() {
        let camera = side_camera();
        let axis = camera.r_w_cam.column(2).into_owned();
        let p = camera.p_w_cam_m + axis;
        let viewer = Viewer::new(&camera, &p);
        let seen = |c: [f64; 6]| viewer.view(&c).project(&p).unwrap();
        let still = seen([0.0; 6]);
        let aside = seen([0.02, -0.015, 0.0, 0.0, 0.0, 0.0]);
        assert!((aside[0] - still[0]).hypot(aside[1] - still[1]) < 0.1);
        // 2 cm to the camera's right at 1 m: the picture moves 7 px to the left.
        let looked = seen([0.0, 0.0, 0.0, 0.02, 0.0, 0.0]);
        assert!((looked[0] - still[0] + 7.0).abs() < 0.1);
    }
}
