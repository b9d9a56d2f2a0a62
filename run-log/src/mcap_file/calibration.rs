//! Where the camera stands and how it sees.

use super::fields::{CAMERA_FRAME, time};
use super::scene::{placed, transform};
use super::urdf::BASE;
use serde_json::{Value, json};
use shared_types::StereoCamera;

/// `foxglove.CameraCalibration` of the left eye.
pub(super) fn calibration(at_ns: u64, camera: &StereoCamera) -> Value {
    let eye = &camera.left;
    let (cx, cy) = (eye.cx, eye.cy);
    json!({
        "timestamp": time(at_ns), "frame_id": CAMERA_FRAME,
        "width": camera.width_px, "height": camera.height_px,
        "distortion_model": "plumb_bob", "D": eye.distortion,
        "K": [eye.fx, 0.0, cx, 0.0, eye.fy, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [eye.fx, 0.0, cx, 0.0, 0.0, eye.fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    })
}

/// Its place in the world.
pub(super) fn place(at_ns: u64, camera: &StereoCamera) -> Value {
    transform(
        at_ns,
        BASE,
        CAMERA_FRAME,
        placed(&camera.p_w_cam_m, &camera.r_w_cam),
    )
}
