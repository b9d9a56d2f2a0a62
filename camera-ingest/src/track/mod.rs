//! Following the rope through a recording.
//!
//! Two passes, since a wiggle is recorded before anybody asks for keypoints:
//! the median over frames spread over the recording is the scene without rope;
//! the first frame, in which the rope hangs still, gives centreline, lead and
//! colours; from there the curve is followed frame by frame, predicted,
//! measured across, smoothed and anchored at the clamp (known from the arm) and
//! the lead. After a gap, a loss, or when something like the rope came near, the
//! rope is looked for anew and followed back to where both ways agree.

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
mod one_pass;
mod outline;
mod plane;
mod pursuit;
mod refusal;
mod sight;
mod state;
mod timing;
mod ways;

use std::time::{Duration, Instant};

pub use appearance::RopeAppearance;
use background::{Background, frames_by_motion};
pub use clamp::{ClampError, ClampPath, ClampSample};
pub use confirmation::Confirmation;
pub use explain::Film;
use first_frame::{FirstLook, Place};
use follow::{Follower, NODES, RopeModel};
pub use models::{FirstMask, FirstScene, ModelError, Models, Moving, PointTracker, SeenPoint};
pub use one_pass::OnePass;
use outline::{Circle, Contrast};
use plane::RopePlane;
pub use refusal::TrackError;
use refusal::check;
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
    /// Where the lead's centre hangs in the first frame, if somebody knows (raw pixel
    /// of the left eye): a hint for a learned mask.
    pub lead_px: Option<[f64; 2]>,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            keypoints: 24,
            background_frames: 31,
            lead_px: None,
        }
    }
}

/// Wall time of the tracker's parts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct TrackTimes {
    /// Median background.
    pub background: Duration,
    /// Finding the rope in the first frame.
    pub first_frame: Duration,
    /// Following it through all frames.
    pub follow: Duration,
}

/// Keypoints and what was learnt on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackResult {
    /// The keypoints.
    pub track: KeypointTrack,
    /// What the rope looks like at rest.
    pub appearance: RopeAppearance,
    /// Per frame: part of the rope's coverage not found (0 = all seen).
    pub residual: Vec<f64>,
    /// Whether the film bears out time and place of the clamp; `None` where the clamp
    /// hardly moves or the rope below it is seen too seldom.
    pub clamp: Option<ClampFit>,
    /// Whether the track may be relied on.
    pub confirmation: Confirmation,
    /// Where the time went.
    pub times: TrackTimes,
}

/// Follows the rope through a recording.
///
/// `frames` are left-eye images, the first with the rope hanging still; time 0
/// of `clamp` is the first frame's start of exposure. Keypoints are raw left
/// pixels, uniform in arc length on the rope's plane.
///
/// # Errors
/// Bad input, no rope found in the first frame, or the rope lost in most frames.
/// Losing it in some is no error: those frames are marked `lost`.
pub fn track(
    frames: &[EyeFrame],
    camera: &StereoCamera,
    clamp: &ClampPath,
    options: &TrackOptions,
) -> Result<TrackResult, TrackError> {
    track_with(frames, camera, clamp, options, &mut Models::default())
}

/// Tracks the rope through a film of one eye or both: by explaining it, and where no
/// simulated rope does, or with learned models, by following it from frame to frame as
/// [`track_with()`].
///
/// `motion` is the attach frame's, t = 0 at the first frame's start of exposure.
///
/// # Errors
/// As [`track_with()`].
pub fn track_film(
    film: Film<'_>,
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    options: &TrackOptions,
    models: &mut Models<'_>,
) -> Result<TrackResult, TrackError> {
    check(film.left, camera, options)?;
    if models.first_mask.is_none() && models.point_tracker.is_none() {
        match explain::explain(film, camera, motion, options) {
            Ok(result) => return Ok(result),
            Err(reason) => {
                tracing::info!(%reason, "no simulated rope explains the film: following it");
            }
        }
    }
    track_with(film.left, camera, &ClampPath::of(motion), options, models)
}

/// As [`track()`], with learned models in the place of its parts.
///
/// # Errors
/// As [`track()`], or a model that gives no answer.
pub fn track_with(
    frames: &[EyeFrame],
    camera: &StereoCamera,
    clamp: &ClampPath,
    options: &TrackOptions,
    models: &mut Models<'_>,
) -> Result<TrackResult, TrackError> {
    check(frames, camera, options)?;
    let times_s: Vec<f64> = frames
        .iter()
        .map(|f| (f.stamp_ns - frames[0].stamp_ns) as f64 * 1e-9)
        .collect();
    let start = Instant::now();
    let background =
        Background::uncovered(frames, &frames_by_motion(frames, options.background_frames));
    let background_time = start.elapsed();

    let start = Instant::now();
    let until_s = times_s[frames.len() - 1];
    let plane = RopePlane::fit(camera, clamp, until_s).ok_or(TrackError::ClampOutside {
        u: f64::NAN,
        v: f64::NAN,
    })?;
    let place = Place {
        background: &background,
        camera,
        plane: &plane,
        clamp: clamp.at(0.0),
        lead_px: options.lead_px,
    };
    let mut built_in = Moving;
    let masker = match &mut models.first_mask {
        Some(learned) => &mut **learned,
        None => &mut built_in as &mut dyn FirstMask,
    };
    let look = first_frame::find(&frames[0], &place, masker, None)?;
    let (follower, first) = learn(&frames[0], camera, clamp, &plane, &background, &look);
    let first_time = start.elapsed();

    let start = Instant::now();
    let states = match &mut models.point_tracker {
        Some(tracker) => by_points::follow(&follower, frames, &times_s, first, &mut **tracker)?,
        None => pursuit::pursue(&follower, frames, &times_s, first),
    };
    let lost = states.iter().filter(|s| s.lost).count();
    if lost * 2 > states.len() {
        return Err(TrackError::MostlyLost {
            lost,
            frames: states.len(),
            first: states.iter().position(|s| s.lost).unwrap_or(0),
        });
    }
    let seen: Vec<_> = states
        .iter()
        .filter(|s| !s.lost && !s.ambiguous)
        .filter_map(|s| Some((s.t_s, s.clamp?)))
        .collect();
    let clamp = timing::fit(&seen, 1.0 / plane.px_per_m, |t_s| follower.clamp_at(t_s));
    let tracked = states
        .iter()
        .map(|s| keypoints(s, &plane, options.keypoints))
        .collect();
    Ok(TrackResult {
        track: KeypointTrack {
            keypoints: options.keypoints,
            frames: tracked,
            doubts: Vec::new(),
        },
        clamp,
        residual: states.iter().map(|s| 1.0 - s.score()).collect(),
        appearance: RopeAppearance {
            rope_radius_m: follower.model.rope_radius_m,
            lead_radius_m: follower.model.lead_radius_m,
            length_m: follower.model.length_m,
            rope_rgb: appearance::rgb(follower.model.rope.0),
            lead_rgb: appearance::rgb(follower.model.lead.0),
            noise: background.noise,
        },
        confirmation: Confirmation {
            doubted: lost as f64 / frames.len() as f64,
            tip: 1.0,
            second_image: None,
        },
        times: TrackTimes {
            background: background_time,
            first_frame: first_time,
            follow: start.elapsed(),
        },
    })
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
