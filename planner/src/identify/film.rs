//! The observation as a grid of detections, and the rope simulated under its motion.

use super::camera_pose::Viewer;
use super::clock::{ClockWindow, clock_window};
use super::coordinates::{Coordinates, Reach};
use super::error::IdentifyError;
use super::options::IdentifyOptions;
use crate::observation::{Observation, ObservedPoints};
use nalgebra::{Vector2, Vector3};
use rope_sim::{
    Candidate, FrameTimes, NodeTrack, Outcome, Precision, Rollout, SimOptions, roll_out,
};
use shared_types::RopeParams;
use shared_types::keypoints::TrackedFrame;

/// Periods at which simulated nodes are kept (s). Between, they are interpolated by
/// cubics: at 16 ms good to 0.02 px for the third harmonic of a wiggle, at 8 ms far
/// better.
const COARSE_SAMPLE_S: f64 = 0.016;
const FINE_SAMPLE_S: f64 = 0.008;
/// Most keypoints of a frame that a coarse comparison looks at.
const COARSE_KEYPOINTS: usize = 13;

/// How exactly a comparison is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fidelity {
    /// Some frames and keypoints, long steps, single precision.
    Coarse,
    /// Everything, in double precision.
    Fine,
}

/// One keypoint of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Detection {
    /// Camera time at which its image row was exposed (s).
    pub(super) time_s: f64,
    /// Place along the rope: 0 the clamp, 1 the lead's centre.
    pub(super) along: f64,
    /// Raw left-image pixel.
    pub(super) pixel: [f64; 2],
    /// Weight, 0 to 1.
    pub(super) weight: f64,
}

/// Detections by frame and keypoint; those that cannot be used are `None`.
#[derive(Debug, Clone)]
pub(super) struct Grid {
    /// Keypoints per frame.
    pub(super) keypoints: usize,
    /// Frame by frame.
    pub(super) cells: Vec<Option<Detection>>,
    /// Whether a frame is the next one after its predecessor in the grid.
    pub(super) follows: Vec<bool>,
}

impl Grid {
    fn new(
        frames: &[&TrackedFrame],
        chosen: &[usize],
        period_s: f64,
        observation: &Observation<'_>,
        confidence_min: f64,
    ) -> Self {
        let keypoints = observation.track.keypoints as f64;
        let detection = |frame: &TrackedFrame, i: usize| {
            let (pixel, confidence) = (frame.points[i], frame.confidence[i]);
            let along = match observation.points {
                ObservedPoints::ArcLength => i as f64 / (keypoints - 1.0),
                ObservedPoints::LinkCentres => (i as f64 + 0.5) / keypoints,
            };
            (confidence >= confidence_min && confidence > 0.0).then(|| Detection {
                time_s: frame.t_s + observation.camera.row_time_s(pixel[1]),
                along,
                pixel,
                weight: confidence.min(1.0),
            })
        };
        let follows = (0..frames.len())
            .map(|i| i > 0 && frames[i].t_s - frames[i - 1].t_s < 1.5 * period_s)
            .collect();
        Self {
            keypoints: chosen.len(),
            cells: frames
                .iter()
                .flat_map(|f| chosen.iter().map(|i| detection(f, *i)))
                .collect(),
            follows,
        }
    }

    /// The least weight among a cell, the one before it in time and those before both along
    /// the rope.
    pub(super) fn least_weight(&self, index: usize) -> f64 {
        let k = self.keypoints;
        let pair = |i: usize| [Some(i), (!i.is_multiple_of(k)).then(|| i - 1)];
        let earlier = (index >= k && self.follows[index / k]).then(|| index - k);
        let cells = pair(index)
            .into_iter()
            .chain(earlier.into_iter().flat_map(pair));
        let weights = cells.flatten().filter_map(|i| Some(self.cells[i]?.weight));
        weights.fold(1.0, f64::min)
    }
}

/// The observation in the form the fit compares.
pub(super) struct Film<'a> {
    pub(super) observation: &'a Observation<'a>,
    pub(super) options: IdentifyOptions,
    pub(super) viewer: Viewer<'a>,
    horizon_s: f64,
    fine: Grid,
    coarse: Grid,
}

impl<'a> Film<'a> {
    pub(super) fn new(observation: &'a Observation<'a>, options: &IdentifyOptions) -> Self {
        let usable: Vec<&TrackedFrame> = observation
            .track
            .frames
            .iter()
            .filter(|f| !f.lost)
            .collect();
        let mut gaps: Vec<f64> = usable.windows(2).map(|w| w[1].t_s - w[0].t_s).collect();
        gaps.sort_by(f64::total_cmp);
        let period_s = gaps.get(gaps.len() / 2).copied().unwrap_or(1.0);
        let every = |count: usize, most: usize| count.div_ceil(most.max(1)).max(1);
        let few: Vec<&TrackedFrame> = usable
            .iter()
            .step_by(every(usable.len(), options.search_frames_max))
            .copied()
            .collect();
        let keypoints = observation.track.keypoints;
        let all: Vec<usize> = (0..keypoints).collect();
        let stride = every(keypoints, COARSE_KEYPOINTS);
        // From the lead backwards: its place tells most.
        let chosen: Vec<usize> = (0..keypoints).rev().step_by(stride).collect();
        let confidence_min = options.confidence_min;
        let grid = |frames: &[&TrackedFrame], chosen: &[usize]| {
            Grid::new(frames, chosen, period_s, observation, confidence_min)
        };
        let film_s = usable.last().map_or(0.0, |f| f.t_s);
        Self {
            viewer: Viewer::new(observation.camera, &observation.motion.at(0.0).p_m),
            options: *options,
            horizon_s: (film_s + options.clock_offset_max_s + 0.03)
                .min(observation.motion.duration_s()),
            fine: grid(&usable, &all),
            coarse: grid(&few, &chosen),
            observation,
        }
    }

    /// The detections compared.
    pub(super) fn grid(&self, fidelity: Fidelity) -> &Grid {
        match fidelity {
            Fidelity::Coarse => &self.coarse,
            Fidelity::Fine => &self.fine,
        }
    }

    /// What the detections of the clamp tell about the clocks.
    pub(super) fn clock_window(&self) -> ClockWindow {
        let first_of_frames = self.fine.cells.iter().step_by(self.fine.keypoints);
        let seen = first_of_frames.flatten().map(|s| (s.time_s, s.pixel));
        let clamp: Vec<(f64, [f64; 2])> = seen.collect();
        let (camera, motion) = (self.observation.camera, self.observation.motion);
        clock_window(&clamp, camera, motion, self.options.clock_offset_max_s)
    }

    /// The coordinates in which the film is fitted.
    pub(super) fn coordinates(&self, clock: ClockWindow, reach: Reach) -> Coordinates {
        let (seen, pixel_m) = (self.observation.appearance, self.viewer.pixel_m());
        let camera_std = self.options.camera_std();
        let coordinates = Coordinates::new(seen, pixel_m, clock, &camera_std, reach);
        coordinates.measured(self.options.length_m)
    }

    /// The camera's line of sight across the rope when the film begins: the first two axes of
    /// the attach frame; zero where it looks along the rope.
    pub(super) fn sight(&self) -> Vector2<f64> {
        let camera = self.observation.camera;
        let attach = self.observation.motion.at(0.0).r;
        let sight = attach.transpose() * camera.r_w_cam.column(2);
        sight.xy().try_normalize(1e-3).unwrap_or_default()
    }

    /// How the filmed motion is simulated.
    pub(super) fn sim_options(&self, fidelity: Fidelity) -> SimOptions {
        let (precision, step_s) = match fidelity {
            Fidelity::Coarse => (Precision::F32, self.options.search_step_s),
            Fidelity::Fine => (Precision::F64, self.options.step_s),
        };
        let period_s = sample_s(fidelity);
        SimOptions {
            frames: FrameTimes {
                first_s: 0.0,
                period_s,
                count: (self.horizon_s / period_s).floor() as usize + 1,
            },
            threads: self.options.threads.max(1),
            ..SimOptions::new(step_s, precision, self.horizon_s)
        }
    }

    /// Simulates the filmed motion with each rope.
    pub(super) fn simulate(
        &self,
        ropes: &[RopeParams],
        fidelity: Fidelity,
    ) -> Result<Vec<Rollout>, IdentifyError> {
        let candidate = |rope| Candidate::new(rope, self.observation.motion);
        let candidates: Vec<Candidate<'_>> = ropes.iter().map(candidate).collect();
        Ok(roll_out(&candidates, &self.sim_options(fidelity))?)
    }
}

/// Period at which nodes are kept (s).
pub(super) fn sample_s(fidelity: Fidelity) -> f64 {
    match fidelity {
        Fidelity::Coarse => COARSE_SAMPLE_S,
        Fidelity::Fine => FINE_SAMPLE_S,
    }
}

/// Whether a simulation stayed finite.
pub(super) fn is_finite(rollout: &Rollout) -> bool {
    !matches!(rollout.outcome, Outcome::Diverged)
}

/// Weights of the four samples around a time: cubic (Catmull-Rom) in time, held
/// before the first and after the last sample.
#[derive(Debug, Clone, Copy)]
pub(super) struct Instant {
    frames: [usize; 4],
    weights: [f64; 4],
}

impl Instant {
    pub(super) fn new(time_s: f64, period_s: f64, samples: usize) -> Self {
        let last = samples - 1;
        let u = (time_s / period_s).clamp(0.0, last as f64);
        let i = (u as usize).min(last.saturating_sub(1));
        let t = u - i as f64;
        let (t2, t3) = (t * t, t * t * t);
        Self {
            frames: [i.saturating_sub(1), i, (i + 1).min(last), (i + 2).min(last)],
            weights: [
                -0.5 * t + t2 - 0.5 * t3,
                1.0 - 2.5 * t2 + 1.5 * t3,
                0.5 * t + 2.0 * t2 - 1.5 * t3,
                -0.5 * t2 + 0.5 * t3,
            ],
        }
    }

    /// Point of the rope at a place along it, linear along the links.
    pub(super) fn position(&self, nodes: &NodeTrack, along: f64) -> Vector3<f64> {
        let last = nodes.nodes() - 1;
        let place = along * last as f64;
        let node = (place as usize).min(last.saturating_sub(1));
        let part = place - node as f64;
        let mut out = Vector3::zeros();
        for (frame, weight) in self.frames.into_iter().zip(self.weights) {
            let a = nodes.position(frame, node);
            let b = nodes.position(frame, (node + 1).min(last));
            out += (a + (b - a) * part) * weight;
        }
        out
    }
}
