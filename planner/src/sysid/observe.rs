//! Distance between filmed and simulated keypoints.

use super::coordinates::{CLOCK, COORDINATES, Coordinates};
use super::{IdentifyError, IdentifyOptions, Observation};
use crate::workers::map_in_order;
use nalgebra::Vector3;
use rope_sim::{
    Candidate, FrameTimes, Outcome, Precision, Rollout, SimOptions, Start, Watch, roll_out,
};
use shared_types::{RopeParams, StereoCamera};

/// Distance given to a candidate that cannot be compared (px).
pub(super) const INVISIBLE_PX: f64 = 1e4;
/// Periods at which simulated nodes are kept in the search and in the polish (s).
/// Between, they are interpolated by cubics: at 16 ms good to 0.02 px for the
/// third harmonic of a wiggle, at 8 ms far better.
const SEARCH_SAMPLE_S: f64 = 0.016;
const POLISH_SAMPLE_S: f64 = 0.008;

/// Simulated nodes with their sampling period.
pub(super) struct Swing {
    pub(super) rollout: Rollout,
    period_s: f64,
}

impl Swing {
    /// Whether the simulation stayed finite.
    pub(super) fn is_finite(&self) -> bool {
        !matches!(self.rollout.outcome, Outcome::Diverged)
    }
}

/// One keypoint of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sighting {
    /// Camera time at which its image row was exposed (s).
    pub(super) time_s: f64,
    /// Place along the rope: 0 the clamp, 1 the lead's centre.
    pub(super) along: f64,
    /// Raw left-eye pixel.
    pub(super) pixel: [f64; 2],
    /// Weight, 0 to 1.
    pub(super) weight: f64,
}

/// The observation in the form the fit compares.
pub(super) struct Film<'a> {
    observation: &'a Observation<'a>,
    search_step_s: f64,
    step_s: f64,
    threads: usize,
    outlier_px: f64,
    horizon_s: f64,
    /// Every usable sighting.
    pub(super) all: Vec<Sighting>,
    /// Those of evenly chosen frames, for the search.
    chosen: Vec<Sighting>,
    /// Usable frames.
    pub(super) frames: usize,
}

impl<'a> Film<'a> {
    pub(super) fn new(observation: &'a Observation<'a>, options: &IdentifyOptions) -> Self {
        let usable: Vec<_> = observation
            .track
            .frames
            .iter()
            .filter(|f| !f.lost)
            .collect();
        let stride = usable
            .len()
            .div_ceil(options.search_frames_max.max(1))
            .max(1);
        #[allow(clippy::cast_precision_loss, reason = "keypoint counts are small")]
        let last = (observation.track.keypoints - 1) as f64;
        let sightings = |frame: &shared_types::keypoints::TrackedFrame| {
            #[allow(clippy::cast_precision_loss, reason = "keypoint counts are small")]
            let all: Vec<Sighting> = frame
                .points
                .iter()
                .zip(&frame.confidence)
                .enumerate()
                .filter(|(_, (_, c))| **c >= options.confidence_min && **c > 0.0)
                .map(|(i, (pixel, confidence))| Sighting {
                    time_s: frame.t_s + observation.camera.row_time_s(pixel[1]),
                    along: i as f64 / last,
                    pixel: *pixel,
                    weight: confidence.min(1.0),
                })
                .collect();
            all
        };
        let film_s = usable.last().map_or(0.0, |f| f.t_s);
        Self {
            search_step_s: options.search_step_s,
            step_s: options.step_s,
            threads: options.threads.max(1),
            outlier_px: options.outlier_px,
            horizon_s: (film_s + options.clock_offset_max_s + 0.03)
                .min(observation.motion.duration_s()),
            all: usable.iter().flat_map(|f| sightings(f)).collect(),
            chosen: usable
                .iter()
                .step_by(stride)
                .flat_map(|f| sightings(f))
                .collect(),
            frames: usable.len(),
            observation,
        }
    }

    /// Robust distance of each point's rope to the chosen frames (px).
    pub(super) fn distances_px(
        &self,
        coordinates: &Coordinates,
        points: &[[f64; COORDINATES]],
    ) -> Result<Vec<f64>, IdentifyError> {
        let ropes: Vec<RopeParams> = points.iter().map(|x| coordinates.rope(x)).collect();
        let swings = self.run(&ropes, Precision::F32, self.search_step_s, SEARCH_SAMPLE_S)?;
        let jobs: Vec<_> = points.iter().zip(&swings).collect();
        Ok(map_in_order(&jobs, self.threads, |(x, swing)| {
            self.distance_px(swing, x[CLOCK])
        }))
    }

    /// The sightings of the clamp.
    pub(super) fn clamp(&self) -> Vec<Sighting> {
        self.all
            .iter()
            .filter(|s| s.along == 0.0)
            .copied()
            .collect()
    }

    /// Simulates the filmed motion with each rope, in double precision.
    pub(super) fn simulate(&self, ropes: &[RopeParams]) -> Result<Vec<Swing>, IdentifyError> {
        self.run(ropes, Precision::F64, self.step_s, POLISH_SAMPLE_S)
    }

    fn run(
        &self,
        ropes: &[RopeParams],
        precision: Precision,
        step_s: f64,
        period_s: f64,
    ) -> Result<Vec<Swing>, IdentifyError> {
        let candidates: Vec<Candidate<'_>> = ropes
            .iter()
            .map(|rope| Candidate::new(rope, self.observation.motion))
            .collect();
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive count of about a thousand"
        )]
        let count = (self.horizon_s / period_s).floor() as usize + 1;
        let rollouts = roll_out(
            &candidates,
            &SimOptions {
                step_s,
                precision,
                start: Start::Equilibrium,
                frames: FrameTimes {
                    first_s: 0.0,
                    period_s,
                    count,
                },
                watch: Watch::NOTHING,
                horizon_s: self.horizon_s,
                threads: self.threads,
            },
        )?;
        Ok(rollouts
            .into_iter()
            .map(|rollout| Swing { rollout, period_s })
            .collect())
    }

    fn distance_px(&self, swing: &Swing, clock_offset_s: f64) -> f64 {
        if !swing.is_finite() {
            return INVISIBLE_PX;
        }
        let (mut sum, mut weights) = (0.0, 0.0);
        for sighting in &self.chosen {
            let Some([du, dv]) = self.residual_px(swing, sighting, clock_offset_s) else {
                return INVISIBLE_PX;
            };
            sum += sighting.weight * huber(du.hypot(dv), self.outlier_px);
            weights += sighting.weight;
        }
        let distance = (sum / f64::max(weights, 1e-9)).sqrt();
        if distance.is_finite() {
            distance
        } else {
            INVISIBLE_PX
        }
    }

    /// Simulated minus observed pixel of one sighting; `None` behind the camera.
    fn residual_px(
        &self,
        swing: &Swing,
        sighting: &Sighting,
        clock_offset_s: f64,
    ) -> Option<[f64; 2]> {
        let camera: &StereoCamera = self.observation.camera;
        let p = position(swing, sighting.time_s - clock_offset_s, sighting.along);
        let [u, v] = camera.project_left(&p)?;
        Some([u - sighting.pixel[0], v - sighting.pixel[1]])
    }

    /// Simulated minus observed pixels of every sighting, for each swing with its
    /// clock offset; `None` if a simulation failed or a point is behind the camera.
    pub(super) fn residuals_px(
        &self,
        swings: &[Swing],
        clock_offsets_s: &[f64],
    ) -> Option<Vec<Vec<[f64; 2]>>> {
        let jobs: Vec<_> = swings.iter().zip(clock_offsets_s).collect();
        map_in_order(&jobs, self.threads, |(swing, offset_s)| {
            let all = || {
                self.all
                    .iter()
                    .map(|s| self.residual_px(swing, s, **offset_s))
                    .collect()
            };
            swing.is_finite().then(all).flatten()
        })
        .into_iter()
        .collect()
    }

    /// Weight of a residual of `distance_px` in an iteratively reweighted fit.
    pub(super) fn influence(&self, distance_px: f64) -> f64 {
        (self.outlier_px / distance_px.max(1e-12)).min(1.0)
    }
}

/// Huber's loss, quadratic below `limit`: `d²`, then linear.
fn huber(d: f64, limit: f64) -> f64 {
    if d <= limit {
        d * d
    } else {
        limit * (2.0 * d - limit)
    }
}

/// Point of the rope at a motion time and a place along it. Cubic (Catmull-Rom)
/// in time, linear along the links; held before the first and after the last
/// sample.
#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "clamped to the sample and node counts"
)]
fn position(swing: &Swing, time_s: f64, along: f64) -> Vector3<f64> {
    let nodes = &swing.rollout.nodes;
    let last_frame = nodes.frames() - 1;
    let last_node = nodes.nodes() - 1;
    let place = along * last_node as f64;
    let node = (place as usize).min(last_node.saturating_sub(1));
    let part = place - node as f64;
    let at = |frame: usize| {
        let (a, b) = (
            nodes.position(frame, node),
            nodes.position(frame, (node + 1).min(last_node)),
        );
        a + (b - a) * part
    };
    let u = (time_s / swing.period_s).clamp(0.0, last_frame as f64);
    let i = (u as usize).min(last_frame.saturating_sub(1));
    let t = u - i as f64;
    let next = (i + 1).min(last_frame);
    let (p0, p1, p2, p3) = (
        at(i.saturating_sub(1)),
        at(i),
        at(next),
        at((i + 2).min(last_frame)),
    );
    p1 + (p2 - p0) * (t / 2.0)
        + (p0 * 2.0 - p1 * 5.0 + p2 * 4.0 - p3) * (t * t / 2.0)
        + (p1 * 3.0 - p0 - p2 * 3.0 + p3) * (t * t * t / 2.0)
}
