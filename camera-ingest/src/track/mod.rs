//! Tracking the rope through a recording.
//!
//! A wiggle is recorded before anybody asks for keypoints, so the whole film is looked at
//! at once: the median over frames spread over it is the scene without rope, and of
//! many simulated ropes, hung on the clamp as the arm moved it, one explains what the
//! scene does not (`explain`). Along it the film is read off frame by frame.
//! A learned tracker of points may stand in for the reading
//! ([`TrackResult::by_points`]).

mod confirmation;
mod explain;
mod inpainting;
mod plane;
mod point_tracker;
mod refusal;
mod scene;
mod sway;
mod timing;

use std::time::Duration;

use confirmation::Confirmation;
pub use explain::Film;
pub(crate) use explain::Known;
pub use point_tracker::{ModelError, PointTracker, SeenPoint};
pub use refusal::TrackError;
pub(crate) use refusal::check_keypoints;
use rope_sim::AttachMotion;
pub(crate) use scene::{median_frame, uncovered_scene};
use shared_types::{KeypointTrack, StereoCamera};
pub use timing::ClampFit;

/// Keypoints per frame where nobody asks for another number.
pub const USUAL_KEYPOINTS: usize = 24;

/// What rope and lead look like.
#[derive(Debug, Clone, PartialEq)]
pub struct RopeAppearance {
    /// Half the rope's apparent width (m).
    pub rope_radius_m: f64,
    /// Radius of the lead's outline (m).
    pub lead_radius_m: f64,
    /// Length from clamp to lead centre (m).
    pub length_m: f64,
    /// Median colour of the rope.
    pub rope_rgb: [u8; 3],
    /// Median colour of the lead.
    pub lead_rgb: [u8; 3],
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
    /// Whether the film bears out time and place of the clamp; `None` where the clamp
    /// hardly moves or the rope below it is seen too seldom.
    pub clamp: Option<ClampFit>,
    /// Where the time went.
    pub times: TrackTimes,
    confirmation: Confirmation,
}

/// Tracks the rope through a film of one eye or both.
///
/// `motion` is the attach frame's, time 0 at the first frame's start of exposure; `camera`
/// is known to a degree and a centimetre or so. Keypoints (2 to 32 per frame) are raw left
/// pixels at equal distances along the rope, clamp first, the lead's centre last.
///
/// # Errors
/// Bad input, or no simulated rope explains the film. Losing the rope in some frames is
/// no error: they are marked `lost`.
pub fn track(
    film: Film<'_>,
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    keypoints: usize,
) -> Result<TrackResult, TrackError> {
    refusal::check(film.left, camera, motion, keypoints)?;
    explain::explain(film, camera, motion, keypoints)
}

/// `count` indices spread over `0..len`.
pub(crate) fn spread(len: usize, count: usize) -> Vec<usize> {
    let count = count.min(len);
    let steps = count.saturating_sub(1).max(1);
    (0..count).map(|i| i * (len - 1) / steps).collect()
}
