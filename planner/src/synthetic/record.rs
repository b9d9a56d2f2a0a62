//! Paths of a rope's keypoints in the world, from the simulator.

use nalgebra::Vector3;
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, NodeTrack, Outcome, Precision, SimOptions, SimulateError,
    roll_out,
};
use shared_types::RopeParams;

/// Where a film's keypoints lie on the rope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeypointLayout {
    /// This many (at least 2), uniform in arc length from the clamp to the
    /// lead's centre: what a tracker gives.
    Uniform(usize),
    /// The centres of the links, as many as the rope has: what the paper's
    /// simulated films show.
    LinkCentres,
}

impl From<usize> for KeypointLayout {
    /// This many, uniform in arc length.
    fn from(keypoints: usize) -> Self {
        Self::Uniform(keypoints)
    }
}

/// How films are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecordOptions {
    /// Where the keypoints are.
    pub layout: KeypointLayout,
    /// Recorded time (s), from the motion's t = 0.
    pub duration_s: f64,
    /// Time between kept positions (s); cubics in between.
    pub period_s: f64,
    /// Longest step of the simulation (s).
    pub step_s: f64,
    /// Number type of the simulation.
    pub precision: Precision,
    /// Threads; the films do not depend on it.
    pub threads: usize,
}

impl Default for RecordOptions {
    /// Fine enough to measure an identification by.
    fn default() -> Self {
        Self {
            layout: KeypointLayout::Uniform(25),
            duration_s: 6.8,
            period_s: 1.0 / 240.0,
            step_s: 5e-4,
            precision: Precision::F64,
            threads: 1,
        }
    }
}

impl RecordOptions {
    /// For thousands of films: the simulator's step for wiggles in single
    /// precision, positions kept 60 times a second.
    #[must_use]
    pub fn for_training(layout: KeypointLayout, threads: usize) -> Self {
        Self {
            layout,
            period_s: 1.0 / 60.0,
            step_s: 1e-3,
            precision: Precision::F32,
            threads,
            ..Self::default()
        }
    }
}

/// Keypoint paths of one rope in one motion (world frame).
#[derive(Debug, Clone, PartialEq)]
pub struct RopeFilm {
    /// The rope.
    pub rope: RopeParams,
    /// Time between kept positions (s).
    pub period_s: f64,
    /// Keypoints per sample.
    pub keypoints: usize,
    /// Whether the simulation stayed finite; positions mean nothing if not.
    pub is_finite: bool,
    /// Sample by sample, one at least, keypoint by keypoint, x y z (m).
    pub positions_m: Vec<f32>,
}

impl RopeFilm {
    /// A film from kept positions: sample by sample, keypoint by keypoint, x y z.
    /// `None` if their number is no whole number of samples, or less than one.
    #[must_use]
    pub fn from_positions(
        rope: RopeParams,
        period_s: f64,
        keypoints: usize,
        positions_m: Vec<f32>,
    ) -> Option<Self> {
        let whole = keypoints > 0 && positions_m.len().is_multiple_of(3 * keypoints);
        (whole && !positions_m.is_empty() && period_s > 0.0).then(|| Self {
            rope,
            period_s,
            keypoints,
            is_finite: positions_m.iter().all(|x| x.is_finite()),
            positions_m,
        })
    }

    /// Position of a keypoint at a motion time (world, m): cubic (Catmull-Rom)
    /// between kept positions, held before the first and after the last.
    ///
    /// # Panics
    /// If there is no such keypoint, as indexing does.
    #[must_use]
    pub fn position(&self, time_s: f64, keypoint: usize) -> Vector3<f64> {
        let last = self.positions_m.len() / (3 * self.keypoints) - 1;
        let place = (time_s / self.period_s).clamp(0.0, last as f64);
        let before = (place as usize).min(last.saturating_sub(1));
        let at = |sample: usize| {
            let i = (sample.min(last) * self.keypoints + keypoint) * 3;
            let p = &self.positions_m[i..i + 3];
            Vector3::new(p[0], p[1], p[2]).cast::<f64>()
        };
        let (p0, p1) = (at(before.saturating_sub(1)), at(before));
        let (p2, p3) = (at(before + 1), at(before + 2));
        let t = place - before as f64;
        p1 + (p2 - p0) * (t / 2.0)
            + (p0 * 2.0 - p1 * 5.0 + p2 * 4.0 - p3) * (t * t / 2.0)
            + (p1 * 3.0 - p0 - p2 * 3.0 + p3) * (t * t * t / 2.0)
    }
}

/// Simulates `ropes` on one motion, hanging still at first, and keeps their
/// keypoints; films in the order of the ropes.
///
/// # Errors
/// What the rope simulator refuses. A rope whose simulation blows up gives a film
/// that [says so](RopeFilm::is_finite).
pub fn record(
    ropes: &[RopeParams],
    motion: &dyn AttachMotion,
    options: &RecordOptions,
) -> Result<Vec<RopeFilm>, SimulateError> {
    let candidates: Vec<Candidate<'_>> = ropes
        .iter()
        .map(|rope| Candidate::new(rope, motion))
        .collect();
    let count = (options.duration_s / options.period_s).floor() as usize + 1;
    let sim_options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: options.period_s,
            count,
        },
        threads: options.threads,
        ..SimOptions::new(options.step_s, options.precision, options.duration_s)
    };
    let rollouts = roll_out(&candidates, &sim_options)?;
    Ok(ropes
        .iter()
        .zip(&rollouts)
        .map(|(rope, rollout)| {
            let places = places(options.layout, rope.links);
            RopeFilm {
                rope: *rope,
                period_s: options.period_s,
                keypoints: places.len(),
                is_finite: rollout.outcome != Outcome::Diverged,
                positions_m: positions_at(&rollout.nodes, &places),
            }
        })
        .collect())
}

/// Places of the keypoints: the node before each and the part of the link after it.
fn places(layout: KeypointLayout, links: u32) -> Vec<(usize, f32)> {
    match layout {
        KeypointLayout::LinkCentres => (0..links as usize).map(|link| (link, 0.5)).collect(),
        KeypointLayout::Uniform(keypoints) => (0..keypoints)
            .map(|k| {
                let place = k as f64 / (keypoints.max(2) - 1) as f64 * f64::from(links);
                let node = (place as usize).min(links as usize - 1);
                (node, (place - node as f64) as f32)
            })
            .collect(),
    }
}

fn positions_at(nodes: &NodeTrack, places: &[(usize, f32)]) -> Vec<f32> {
    let mut out = Vec::with_capacity(nodes.frames() * places.len() * 3);
    for frame in 0..nodes.frames() {
        for (node, part) in places {
            let (a, b) = (
                nodes.position(frame, *node).cast::<f32>(),
                nodes.position(frame, node + 1).cast::<f32>(),
            );
            out.extend_from_slice((a + (b - a) * *part).as_slice());
        }
    }
    out
}
