//! The rig's stereo camera: where it stands and how it sees.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};
use shared_types::{Intrinsics, Shutter, StereoCamera};

/// Picture size of each eye, as the modes of a ZED class camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Resolution {
    /// 672x376, focal length 350 px.
    #[serde(rename = "VGA")]
    Vga,
    /// 1280x720, focal length 700 px. A slow machine drops frames.
    #[serde(rename = "HD")]
    Hd,
}

/// Set-up of the camera. It looks along +y at the plane of the arm; the
/// defaults are those of a ZED 2 in its fastest common mode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CameraConfig {
    /// Whether frames are drawn and published at all.
    pub enabled: bool,
    /// Picture size.
    pub resolution: Resolution,
    /// Frames per second.
    pub frame_rate_hz: f64,
    /// Exposure of a row (s).
    pub exposure_s: f64,
    /// Time from one row to the next (s); 0 exposes all rows together. A ZED 2 takes
    /// 26.1 µs in VGA and 15.7 µs in HD at 60 frames per second.
    pub line_time_s: f64,
    /// Distance between the eyes (m).
    pub baseline_m: f64,
    /// Left optical centre in the world (m).
    pub position_m: [f64; 3],
    /// Upward tilt of the optical axis (rad).
    pub tilt_up_rad: f64,
    /// Standard deviation of the luma noise, in levels of 255.
    pub noise_levels: f32,
    /// Time from the start of exposure to the frame's arrival (s).
    pub latency_s: f64,
}

impl Default for CameraConfig {
    fn default() -> Self {
        Self {
            enabled: true,
            resolution: Resolution::Vga,
            frame_rate_hz: 60.0,
            exposure_s: 0.004,
            line_time_s: 0.0,
            baseline_m: 0.12,
            position_m: [0.72, -1.40, 0.14],
            tilt_up_rad: 0.0,
            noise_levels: 1.6,
            latency_s: 0.030,
        }
    }
}

impl CameraConfig {
    /// The calibrated camera: mild barrel distortion, principal points off the
    /// centre and eyes misaligned by a few milliradians, like factory files of
    /// real cameras.
    #[must_use]
    pub fn stereo_camera(&self) -> StereoCamera {
        let (width_px, height_px, scale) = match self.resolution {
            Resolution::Vga => (672, 376, 1.0),
            Resolution::Hd => (1280, 720, 2.0),
        };
        let image = |du: f64, dv: f64, k1: f64| Intrinsics {
            fx: 350.0 * scale,
            fy: 349.7 * scale,
            cx: f64::from(width_px) / 2.0 - 0.5 + du * scale,
            cy: f64::from(height_px) / 2.0 - 0.5 + dv * scale,
            distortion: [k1, 0.027, 3e-4, -2e-4, -0.001],
        };
        let looking_along_y = Matrix3::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0);
        let tilt = Rotation3::from_axis_angle(&Vector3::x_axis(), self.tilt_up_rad);
        StereoCamera {
            width_px,
            height_px,
            left: image(2.3, -1.7, -0.170),
            right: image(-3.1, 0.9, -0.168),
            r_right_left: *Rotation3::new(Vector3::new(-0.0009, 0.0045, 0.0007)).matrix(),
            t_right_left_m: Vector3::new(self.baseline_m, 1e-4, -2e-4),
            r_w_cam: tilt.matrix() * looking_along_y,
            p_w_cam_m: Vector3::from(self.position_m),
            shutter: if self.line_time_s > 0.0 {
                Shutter::Rolling
            } else {
                Shutter::Global
            },
            exposure_s: self.exposure_s,
            line_time_s: self.line_time_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::Pole;
    use arm_model::joint::START_POSE;

    /// Inside both pictures with `radius_m` to spare.
    fn seen(camera: &StereoCamera, p: Vector3<f64>, radius_m: f64) -> bool {
        [Vector3::x(), -Vector3::x(), Vector3::z(), -Vector3::z()]
            .iter()
            .map(|d| p + d * radius_m)
            .all(|p| {
                [camera.project_left(&p), camera.project_right(&p)]
                    .iter()
                    .all(|pixel| pixel.is_some_and(|pixel| camera.contains(pixel)))
            })
    }

    #[test]
    fn both_eyes_see_the_swinging_rope_and_every_sensible_target() {
        let camera = CameraConfig::default().stereo_camera();
        let (clamp, _) = Pole::default().attach_pose(&START_POSE);
        for degrees in -90..=90 {
            let angle = f64::from(degrees).to_radians();
            let tip = clamp + Vector3::new(angle.sin(), 0.0, -angle.cos()) * 0.65;
            // To the robot's side the column ends the swing.
            if degrees > -70 {
                assert!(seen(&camera, tip, 0.045), "tip at {degrees} degrees: {tip}");
            }
        }
        for rho in [0.8, 1.1] {
            for z in [-0.2, 0.7] {
                for bearing in [-20.0_f64, 0.0, 20.0] {
                    let b = bearing.to_radians();
                    let target = Vector3::new(rho * b.cos(), rho * b.sin(), z);
                    assert!(seen(&camera, target, 0.02), "target {target}");
                }
            }
        }
    }
}
