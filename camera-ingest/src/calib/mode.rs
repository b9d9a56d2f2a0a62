//! Video modes, and what a calibration contains for one.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use shared_types::{Intrinsics, StereoCamera};

/// Video mode of the camera; it names the calibration's sections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum VideoMode {
    /// 2208x1242 per image.
    #[serde(rename = "2K")]
    TwoK,
    /// 1920x1080 per image.
    #[serde(rename = "FHD", alias = "HD1080")]
    FullHd,
    /// 1280x720 per image.
    #[serde(rename = "HD", alias = "HD720")]
    Hd,
    /// 672x376 per image.
    #[serde(rename = "VGA")]
    Vga,
}

impl VideoMode {
    /// Suffix in the calibration file.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::TwoK => "2K",
            Self::FullHd => "FHD",
            Self::Hd => "HD",
            Self::Vga => "VGA",
        }
    }

    /// The mode whose images have the size of a calibration's.
    ///
    /// # Errors
    /// None has; in words.
    pub fn of_camera(camera: &StereoCamera) -> Result<Self, String> {
        let size_px = (camera.width_px, camera.height_px);
        let all = [Self::TwoK, Self::FullHd, Self::Hd, Self::Vga];
        let found = all.into_iter().find(|mode| mode.size_px() == size_px);
        let (width_px, height_px) = size_px;
        found.ok_or_else(|| {
            format!("no camera of this system has images of {width_px}x{height_px} pixels")
        })
    }

    /// Width and height of one image (px).
    #[must_use]
    pub fn size_px(self) -> (u32, u32) {
        match self {
            Self::TwoK => (2208, 1242),
            Self::FullHd => (1920, 1080),
            Self::Hd => (1280, 720),
            Self::Vga => (672, 376),
        }
    }
}

/// What a calibration contains for one mode: `X_right = R X_left - t`.
#[derive(Debug, Clone, Copy)]
pub(super) struct StereoGeometry {
    pub(super) left: Intrinsics,
    pub(super) right: Intrinsics,
    pub(super) r_right_left: Matrix3<f64>,
    pub(super) t_right_left_m: Vector3<f64>,
}
