//! Following the rope through a recording.
//!
//! Two passes, since a wiggle is recorded before anybody asks for keypoints:
//! the median over frames spread over the recording is the scene without rope;
//! the first frame, in which the rope hangs still, gives centreline, lead and
//! colours; from there the curve is followed frame by frame, predicted,
//! measured across, smoothed and anchored at the clamp (known from the arm) and
//! the lead. After a gap, a loss, or when something like the rope came near, the
//! rope is looked for anew and followed back to where both ways agree.

mod appearance;
mod background;
mod clamp;
mod curve;
mod evidence;
mod first_frame;
mod follow;
mod geodesic;
mod lateral;
mod lead;
mod outline;
mod plane;
mod pursuit;
mod timing;

use std::time::{Duration, Instant};

pub use appearance::RopeAppearance;
use background::{Background, frames_by_motion};
pub use clamp::{ClampError, ClampPath, ClampSample};
use first_frame::{FirstLook, NotFound};
use follow::{Follower, NODES, RopeModel, State};
use outline::{Circle, Contrast};
use plane::RopePlane;
use shared_types::keypoints::{MAX_KEYPOINTS, TrackedFrame};
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
    /// Where the time went.
    pub times: TrackTimes,
}

/// Why a recording cannot be tracked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Too few frames, or too many or few keypoints.
    #[error("tracking: {what} is {found}, it must be {least} to {most}")]
    Range {
        /// `frames` or an option's name.
        what: &'static str,
        /// Number given.
        found: usize,
        /// Least allowed.
        least: usize,
        /// Most allowed.
        most: usize,
    },
    /// Frames differ from the camera's size.
    #[error(
        "tracking: frame {frame} is {found:?} px, the camera's mode gives {expected:?} px per eye; \
         is the `mode` in camera.toml the one recorded?"
    )]
    Size {
        /// Index of the frame.
        frame: usize,
        /// Its size.
        found: [usize; 2],
        /// The camera's.
        expected: [usize; 2],
    },
    /// Times of the frames do not increase.
    #[error("tracking: the time stamp of frame {frame} is not later than the one before")]
    Times {
        /// Index of the frame.
        frame: usize,
    },
    /// The clamp cannot be seen.
    #[error(
        "tracking: in the first frame (frame 0) the clamp should be at pixel ({u:.0}, {v:.0}), outside the \
         image; check the camera's extrinsics and the clamp's path"
    )]
    ClampOutside {
        /// Pixel column.
        u: f64,
        /// Pixel row.
        v: f64,
    },
    /// No rope in the first frame.
    #[error(
        "tracking: nothing long enough hangs on the clamp in the first frame (frame 0; longest {longest_m:.3} \
         m); the rope must hang still at first, move later, and differ from what is behind it"
    )]
    NoRope {
        /// Longest moving thing that hangs on the clamp (m).
        longest_m: f64,
    },
    /// The rope cannot be followed.
    #[error(
        "tracking: the rope is lost in {lost} of {frames} frames, first in frame {first}; does it \
         leave the image, or does something cover it?"
    )]
    MostlyLost {
        /// Frames in which it is lost.
        lost: usize,
        /// All frames.
        frames: usize,
        /// First frame in which it is lost, from 0.
        first: usize,
    },
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
    check(frames, camera, options)?;
    let times_s: Vec<f64> = frames
        .iter()
        .map(|f| (f.stamp_ns - frames[0].stamp_ns) as f64 * 1e-9)
        .collect();
    let start = Instant::now();
    let background =
        Background::median(frames, &frames_by_motion(frames, options.background_frames));
    let background_time = start.elapsed();

    let start = Instant::now();
    let until_s = times_s[frames.len() - 1];
    let plane = RopePlane::fit(camera, clamp, until_s).ok_or(TrackError::ClampOutside {
        u: f64::NAN,
        v: f64::NAN,
    })?;
    let look = first_frame::find(
        &frames[0],
        &background,
        camera,
        &plane,
        &clamp.at(0.0),
        None,
    )
    .map_err(|e| match e {
        NotFound::ClampOutside([u, v]) => TrackError::ClampOutside { u, v },
        NotFound::NothingHangs(longest_m) => TrackError::NoRope { longest_m },
    })?;
    let (follower, first) = learn(&frames[0], camera, clamp, &plane, &background, &look);
    let first_time = start.elapsed();

    let start = Instant::now();
    let states = pursuit::pursue(&follower, frames, &times_s, first);
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
        times: TrackTimes {
            background: background_time,
            first_frame: first_time,
            follow: start.elapsed(),
        },
    })
}

fn check(
    frames: &[EyeFrame],
    camera: &StereoCamera,
    options: &TrackOptions,
) -> Result<(), TrackError> {
    let range = |what, found, least, most| {
        if (least..=most).contains(&found) {
            Ok(())
        } else {
            Err(TrackError::Range {
                what,
                found,
                least,
                most,
            })
        }
    };
    range("frames", frames.len(), 8, usize::MAX)?;
    range("keypoints", options.keypoints, 2, MAX_KEYPOINTS)?;
    range("background_frames", options.background_frames, 3, 255)?;
    let expected = [camera.width_px as usize, camera.height_px as usize];
    for (frame, f) in frames.iter().enumerate() {
        let found = [f.width_px, f.height_px];
        if found != expected {
            return Err(TrackError::Size {
                frame,
                found,
                expected,
            });
        }
        if frame > 0 && f.stamp_ns <= frames[frame - 1].stamp_ns {
            return Err(TrackError::Times { frame });
        }
    }
    Ok(())
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
    let mut state = State {
        t_s: -1e-3,
        curve: curve::resample(&smooth, curve::length(&smooth), NODES),
        velocity: vec![[0.0; 2]; NODES],
        confidence: vec![1.0; NODES],
        lost: false,
        ambiguous: false,
        clamp: None,
    };
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

/// Per-pixel median of some frames.
pub(crate) fn median_frame(frames: &[EyeFrame]) -> EyeFrame {
    let all: Vec<usize> = (0..frames.len()).collect();
    Background::median(frames, &all).image
}
