//! Following the rope through a recording.
//!
//! A wiggle is recorded before anybody asks for keypoints, so the whole film is looked at
//! at once: the median over frames spread over it is the scene without rope, and of
//! many simulated ropes, hung on the clamp as the arm moved it, one explains what the
//! scene does not (`explain`). Along it the film is read off frame by frame.
//! A learned tracker of points may stand in for the reading
//! ([`TrackResult::by_points`]).

mod appearance;
mod background;
mod by_points;
mod confirmation;
mod covered;
mod explain;
mod models;
mod plane;
mod refusal;
mod timing;

use std::time::Duration;

pub use appearance::RopeAppearance;
use background::{Background, frames_by_motion};
pub use confirmation::Confirmation;
pub use explain::Film;
pub(crate) use explain::Known;
pub use models::{ModelError, PointTracker, SeenPoint};
pub use refusal::TrackError;
use refusal::check;
pub(crate) use refusal::check_keypoints;
use rope_sim::AttachMotion;
use shared_types::{KeypointTrack, StereoCamera};
pub use timing::ClampFit;

use crate::frame::EyeFrame;

/// What a caller may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackOptions {
    /// Keypoints per frame, clamp and lead centre included (2 to 32).
    pub keypoints: usize,
    /// Frames for the median background.
    pub background_frames: usize,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            keypoints: 24,
            background_frames: 31,
        }
    }
}

/// Wall time of the tracker's parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TrackTimes {
    /// Median background.
    pub background: Duration,
    /// Searching for the rope that explains the film.
    pub searching: Duration,
    /// Reading the film off along it.
    pub reading: Duration,
}

/// Keypoints and what was learnt on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackResult {
    /// The keypoints.
    pub track: KeypointTrack,
    /// What the rope looks like.
    pub appearance: RopeAppearance,
    /// Per frame: part of the rope that is not evident (0 = all seen).
    pub residual: Vec<f64>,
    /// Whether the film bears out time and place of the clamp; `None` where the clamp
    /// hardly moves or the rope below it is seen too seldom.
    pub clamp: Option<ClampFit>,
    /// Whether the track may be relied on.
    pub confirmation: Confirmation,
    /// Where the time went.
    pub times: TrackTimes,
}

/// Tracks the rope through a film of one eye or both.
///
/// `motion` is the attach frame's, time 0 at the first frame's start of exposure; `camera`
/// is known to a degree and a centimetre or so. Keypoints are raw left pixels at equal
/// distances along the rope, clamp first, the lead's centre last.
///
/// # Errors
/// Bad input, or no simulated rope explains the film. Losing the rope in some frames is
/// no error: they are marked `lost`.
pub fn track(
    film: Film<'_>,
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    options: &TrackOptions,
) -> Result<TrackResult, TrackError> {
    check(film.left, camera, motion, options)?;
    explain::explain(film, camera, motion, options)
}

/// `count` indices spread over `0..len`.
pub(crate) fn spread(len: usize, count: usize) -> Vec<usize> {
    let count = count.min(len);
    let steps = count.saturating_sub(1).max(1);
    (0..count).map(|i| i * (len - 1) / steps).collect()
}

/// The scene behind what moves in some frames, of which `count` at most are looked at.
pub(crate) fn uncovered_scene(frames: &[EyeFrame], count: usize) -> EyeFrame {
    Background::uncovered(frames, &frames_by_motion(frames, count)).image
}

/// Per-pixel median of some frames.
pub(crate) fn median_frame(frames: &[EyeFrame]) -> EyeFrame {
    let all: Vec<usize> = (0..frames.len()).collect();
    Background::median(frames, &all).image
}
