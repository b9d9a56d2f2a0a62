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

/// Why keypoints give no features.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ObserveError {
    /// The keypoints contradict themselves.
    #[error(transparent)]
    Keypoints(#[from] KeypointError),
    /// The camera looks along the plane of the wiggle.
    #[error(
        "the camera looks at the plane of the wiggle from {degrees:.0} degrees, at least {min} are needed: film it from the side"
    )]
    EdgeOn {
        /// Angle between the view and the plane (degrees).
        degrees: f64,
        /// Smallest angle allowed (degrees).
        min: f64,
    },
    /// The clamp hardly moves sideways, so that there is no plane of the wiggle.
    #[error("the clamp moves {moved_mm:.1} mm sideways, at least {min_mm} mm make a wiggle")]
    NoWiggle {
        /// Way of the clamp (mm).
        moved_mm: f64,
        /// Way needed (mm).
        min_mm: f64,
    },
    /// The clamp does not move as in the wiggle that the features are for.
    #[error(
        "the clamp does not move as in the wiggle the network was trained on: correlation {correlation:.2} (at least {correlation_min} is needed), its sideways motion {:.0} % of the trained one's: film that wiggle, or use --method hybrid",
        part * 100.0
    )]
    OtherWiggle {
        /// Of the clamp's sway with the known one.
        correlation: f64,
        /// Least correlation.
        correlation_min: f64,
        /// Size of the sway as a part of the known one's.
        part: f64,
    },
    /// More link centres than the features have room for, or no two.
    #[error("{found} link centres, but 2 to {max} are expected")]
    LinkCentres {
        /// Points of the track.
        found: usize,
        /// Most there may be.
        max: usize,
    },
    /// The network reads link centres, which a camera does not show.
    #[error(
        "the network reads the centres of the rope's links, which only simulated films show (experiments sysid): name a network of keypoints uniform in arc length, or none for the built-in one"
    )]
    NeedsLinkCentres,
    /// The film shows link centres, the network reads keypoints uniform in arc length.
    #[error(
        "the film shows link centres, but the network reads keypoints uniform in arc length: name one trained with `points = \"link-centres\"`"
    )]
    NeedsArcLength,
    /// The rope was seen in too few frames.
    #[error(
        "the rope was seen in {seen} of {frames} frames at 60 Hz, the network needs {min}: film again with the whole rope in view"
    )]
    TooFewSeen {
        /// Frames seen.
        seen: usize,
        /// Frames of the network's input.
        frames: usize,
        /// Frames needed.
        min: usize,
    },
}
