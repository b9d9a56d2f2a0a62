//! What the numbers of the features mean, and why there may be none.

use crate::observation::ObservedPoints;
use serde::{Deserialize, Serialize};
use shared_types::keypoints::KeypointError;

/// Numbers in [`WiggleFeatures::widths`].
pub const WIDTHS: usize = 4;

/// Shape of the features; part of a network's identity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureDefinition {
    /// Version of the meaning of the channels: [`FeatureDefinition::VERSION`].
    pub version: u32,
    /// Frames.
    pub frames: usize,
    /// Frames per second (Hz).
    pub rate_hz: f64,
    /// Keypoints; of link centres the most there may be.
    pub keypoints: usize,
    /// Where on the rope they lie.
    #[serde(default)]
    pub points: ObservedPoints,
}

impl Default for FeatureDefinition {
    fn default() -> Self {
        Self {
            version: Self::VERSION,
            frames: 400,
            rate_hz: 60.0,
            keypoints: 16,
            points: ObservedPoints::ArcLength,
        }
    }
}

impl FeatureDefinition {
    /// Version of the meaning of the channels that this code makes.
    pub const VERSION: u32 = 2;

    /// Channels of a frame.
    #[must_use]
    pub fn channels(&self) -> usize {
        3 * self.keypoints
    }
}

/// Input of the network.
#[derive(Debug, Clone, PartialEq)]
pub struct WiggleFeatures {
    /// What the numbers mean.
    pub definition: FeatureDefinition,
    /// Frame by frame, channel by channel.
    pub motion: Vec<f32>,
    /// Half widths of rope and lead (m), each followed by 1; two zeros where it
    /// was not seen.
    pub widths: [f32; WIDTHS],
    /// Frames that were seen.
    pub seen: usize,
}

impl WiggleFeatures {
    /// Blanks frames as if they had not been seen.
    pub fn mask(&mut self, frames: core::ops::Range<usize>) {
        let channels = self.definition.channels();
        let frames =
            frames.start.min(self.definition.frames)..frames.end.min(self.definition.frames);
        for frame in
            self.motion[frames.start * channels..frames.end * channels].chunks_mut(channels)
        {
            if frame[channels - 1] > 0.0 {
                self.seen -= 1;
            }
            frame.fill(0.0);
        }
    }
}

/// Why keypoints give no features: what is wrong with the film, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct ObserveError(String);

impl ObserveError {
    pub(crate) fn new(reason: impl Into<String>) -> Self {
        Self(reason.into())
    }
}

impl From<KeypointError> for ObserveError {
    fn from(error: KeypointError) -> Self {
        Self(error.to_string())
    }
}
