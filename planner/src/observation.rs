//! What a camera and an arm say of one filmed wiggle.

use rope_sim::AttachMotion;
use serde::{Deserialize, Serialize};
use shared_types::ipc::message::RopeAppearance;
use shared_types::{KeypointTrack, StereoCamera};

/// Places on the rope that are observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ObservedPoints {
    /// Uniform in arc length from the clamp to the lead's centre: what a tracker gives.
    #[default]
    ArcLength,
    /// The centres of the links from the clamp on, as many as the rope has: what only a
    /// simulated film shows.
    LinkCentres,
}

/// Sizes seen in the picture, where it was sharp enough.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Appearance {
    /// Half of the rope's apparent width (m).
    pub rope_radius_m: Option<f64>,
    /// Half of the lead's apparent width (m).
    pub lead_radius_m: Option<f64>,
}

impl Appearance {
    /// How far a half width seen in the picture may be from the radius (m): a part of
    /// it for the distance of the camera, and a quarter of a pixel of this size.
    pub(crate) fn std_dev_m(radius_m: f64, pixel_m: f64) -> f64 {
        (0.02 * radius_m).hypot(0.25 * pixel_m)
    }
}

impl From<RopeAppearance> for Appearance {
    fn from(seen: RopeAppearance) -> Self {
        Self {
            rope_radius_m: seen.rope_radius_m,
            lead_radius_m: seen.lead_radius_m,
        }
    }
}

/// What was filmed.
#[derive(Clone, Copy)]
pub struct Observation<'a> {
    /// Keypoints, from the clamp to the lead; times count from the first frame.
    pub track: &'a KeypointTrack,
    /// Where on the rope they lie: uniform in arc length in anything that a camera saw.
    pub points: ObservedPoints,
    /// The camera; keypoints are raw pixels of its left image.
    pub camera: &'a StereoCamera,
    /// Measured motion of the attach frame; t = 0 is the first frame, up to the
    /// clock offset that is fitted.
    pub motion: &'a dyn AttachMotion,
    /// Widths seen in the picture.
    pub appearance: Appearance,
}

impl core::fmt::Debug for Observation<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Observation")
            .field("frames", &self.track.frames.len())
            .field("keypoints", &self.track.keypoints)
            .field("motion_s", &self.motion.duration_s())
            .field("appearance", &self.appearance)
            .finish_non_exhaustive()
    }
}
