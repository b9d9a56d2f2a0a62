//! The camera that films a wiggle, and its misplacement.

use nalgebra::{Matrix3, Rotation3, Vector3};
use shared_types::{Intrinsics, Shutter, StereoCamera};

/// A rolling-shutter camera of 672 x 376 px beside the wiggle, looking across
/// its plane from 1 m.
#[must_use]
pub fn side_camera() -> StereoCamera {
    let image = Intrinsics {
        fx: 350.0,
        fy: 350.0,
        cx: 335.5,
        cy: 187.5,
        distortion: [-0.17, 0.03, 0.0, 0.0, 0.0],
    };
    StereoCamera {
        width_px: 672,
        height_px: 376,
        left: image,
        right: image,
        r_right_left: Matrix3::identity(),
        t_right_left_m: Vector3::new(0.063, 0.0, 0.0),
        r_w_cam: Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0),
        p_w_cam_m: Vector3::new(0.66, -1.0, -0.05),
        shutter: Shutter::Rolling,
        exposure_s: 0.004,
        line_time_s: 26e-6,
    }
}

/// The camera as it really stands, when its calibration is off: its centre
/// moved by `position_m` and the point it looks at, `depth_m` ahead, by
/// `lookat_m` (world frame). Its roll follows with the smallest turn.
pub(super) fn misplaced(
    camera: &StereoCamera,
    depth_m: f64,
    position_m: Vector3<f64>,
    lookat_m: Vector3<f64>,
) -> StereoCamera {
    let axis = camera.r_w_cam.column(2).into_owned();
    let lookat = camera.p_w_cam_m + axis * depth_m + lookat_m;
    let position = camera.p_w_cam_m + position_m;
    let turn = Rotation3::rotation_between(&axis, &(lookat - position))
        .unwrap_or_else(Rotation3::identity);
    StereoCamera {
        r_w_cam: turn.matrix() * camera.r_w_cam,
        p_w_cam_m: position,
        ..camera.clone()
    }
}
