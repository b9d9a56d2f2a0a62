//! Following the rope through a recording.
//!
//! A wiggle is recorded before anybody asks for keypoints, so the whole film is looked at
//! at once: the median over frames spread over it is the scene without rope, and of
//! many simulated ropes, hung on the clamp as the arm moved it, one explains what the
//! scene does not (`explain`). Along it the film is read off frame by frame.
//! A learned tracker of points may stand in for the reading
//! ([`TrackResult::by_points`]).

mod anew;
mod appearance;
mod background;
mod by_points;
mod clamp;
mod confirmation;
mod covered;
mod curve;
mod evidence;
mod explain;
mod first_frame;
mod follow;
mod geodesic;
mod lateral;
mod lead;
mod models;
mod moving;
mod outline;
mod plane;
mod refusal;
mod sight;
mod state;
mod timing;

use std::time::Duration;

pub use appearance::RopeAppearance;
use background::{Background, frames_by_motion};
pub use clamp::{ClampError, ClampPath, ClampSample};
pub use confirmation::Confirmation;
pub use explain::Film;
use first_frame::FirstLook;
use follow::{Follower, NODES, RopeModel};
pub use models::{ModelError, PointTracker, SeenPoint};
pub(crate) use explain::{Known, NoRope};
use outline::{Circle, Contrast};
use plane::RopePlane;
pub use refusal::TrackError;
use refusal::check;
pub(crate) use refusal::check_keypoints;
use rope_sim::AttachMotion;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};
use state::State;
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

/// Turns the first look into a model of the rope and the first state.
fn learn<'a>(
    frame: &EyeFrame,
    camera: &'a StereoCamera,
    clamp: &'a ClampPath,
    plane: &'a RopePlane,
    background: &'a Background,
    look: &FirstLook,
) -> (Follower<'a>, State) {
    let gain = background.gain(frame);
    let mut follower = Follower {
        camera,
        clamp,
        plane,
        background,
        model: RopeModel {
            rope: look.rope,
            lead: look.lead,
            rope_radius_m: 2.0 / plane.px_per_m,
            lead_radius_m: look.lead_radius_px / plane.px_per_m,
            length_m: curve::length(&look.path),
            usual_coverage: 1.0,
        },
    };
    let smooth = curve::smooth(&look.path, &vec![0.05; look.path.len()], 20.0);
    let mut state = State::resting(
        -1e-3,
        curve::resample(&smooth, curve::length(&smooth), NODES),
    );
    let contrast = Contrast {
        frame,
        background,
        gain,
    };
    // Each round sees the rope with the colours and widths of the one before.
    for _ in 0..3 {
        state = follower.step(frame, 0.0, &state);
        state.velocity.fill([0.0; 2]);
        state.t_s = -1e-3;
        let pixels: Vec<[f64; 2]> = state.curve.iter().map(|p| plane.to_pixel(*p)).collect();
        let middle = pixels[NODES / 6..NODES * 5 / 6].iter();
        let near = middle.map(|p| [p[0].round() as usize, p[1].round() as usize]);
        follower.model.rope = first_frame::colour_of(frame, gain, near);
        if let Some(radius) = appearance::rope_radius_m(&state.curve, plane, &contrast) {
            follower.model.rope_radius_m = radius;
        }
        let guess = Circle {
            centre: pixels[NODES - 1],
            radius_px: look.lead_radius_px,
        };
        let rope = follower.rope_at_lead(&state.curve);
        if follower.model.lead_blends_in() {
            follower.model.lead_radius_m = follower.model.rope_radius_m;
        } else if let Some(circle) = contrast.circle(guess, 0.0, rope) {
            follower.model.lead_radius_m = circle.radius_px / plane.px_per_m;
        }
        follower.model.length_m = curve::length(&state.curve);
    }
    follower.model.usual_coverage = state.score().clamp(0.2, 1.0);
    state.t_s = 0.0;
    state.confidence.fill(1.0);
    (follower, state)
}

/// `count` keypoints of a state.
fn keypoints(state: &State, plane: &RopePlane, count: usize) -> TrackedFrame {
    let points = curve::resample(&state.curve, curve::length(&state.curve), count);
    TrackedFrame {
        t_s: state.t_s,
        points: points.iter().map(|p| plane.to_pixel(*p)).collect(),
        confidence: (0..count)
            .map(|i| {
                let at = i as f64 * (NODES - 1) as f64 / (count - 1) as f64;
                state.confidence[at.round() as usize].clamp(0.0, 1.0)
            })
            .collect(),
        lost: state.lost,
    }
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
