//! How much the rope sways after a move.

use super::CalmError;
use super::chain::Prelude;
use nalgebra::Vector3;
use rope_sim::{
    Candidate, FrameTimes, NodeTrack, Outcome, PlannedArm, Precision, SimOptions, Start, Watch,
    roll_out,
};
use shared_types::{JointTrajectory, RopeParams};

/// Time after the move in which sway is looked for (s): one period of the
/// slowest pendulum of the parameter ranges, 0.6 Hz.
const WINDOW_S: f64 = 1.6;
/// Time between looks (s): more than ten per period of the second mode.
const PERIOD_S: f64 = 1.0 / 30.0;
/// Step of the simulation (s).
const STEP_S: f64 = 1e-3;

/// The rope during and after one move.
#[derive(Debug)]
pub(super) struct Sway {
    /// Displacements of tip and middle from rest after the move, all axes (m).
    pub(super) displacements_m: Vec<f64>,
    /// Largest distance of the tip from its place at rest after the move (m).
    pub(super) largest_m: f64,
    /// Nodes from the start of the move on, [`Self::time_s`] apart.
    pub(super) nodes: NodeTrack,
    /// Whether the simulation stayed finite; nothing else means anything if not.
    pub(super) finite: bool,
}

impl Sway {
    /// Time of a frame of `nodes` after the start of the move (s).
    #[allow(clippy::cast_precision_loss, reason = "a few hundred frames")]
    pub(super) fn time_s(frame: usize) -> f64 {
        frame as f64 * PERIOD_S
    }
}

/// Simulates one rope through moves of one duration and end pose.
#[derive(Debug)]
pub(super) struct SwaySimulator<'a> {
    rope: &'a RopeParams,
    /// What the arm did before.
    pub(super) prelude: &'a Prelude,
    /// Tip and middle of the rope at rest in the end pose: node and place (m).
    rest: [(usize, Vector3<f64>); 2],
    options: SimOptions,
    /// First frame after the move.
    settled_frame: usize,
}

impl<'a> SwaySimulator<'a> {
    /// For moves that share duration and end pose with `plain`.
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "positive counts of a few hundred"
    )]
    pub(super) fn new(
        rope: &'a RopeParams,
        prelude: &'a Prelude,
        plain: &JointTrajectory,
        threads: usize,
    ) -> Result<Self, CalmError> {
        let shown_s = plain.duration_s() + WINDOW_S;
        Ok(Self {
            rope,
            prelude,
            rest: rest(rope, prelude, plain)?,
            options: SimOptions {
                step_s: STEP_S,
                precision: Precision::F32,
                start: Start::Equilibrium,
                frames: FrameTimes {
                    first_s: prelude.start_s,
                    period_s: PERIOD_S,
                    count: (shown_s / PERIOD_S).floor() as usize + 1,
                },
                watch: Watch::NOTHING,
                horizon_s: prelude.start_s + shown_s,
                threads,
            },
            settled_frame: (plain.duration_s() / PERIOD_S).ceil() as usize,
        })
    }

    /// Sway of the rope after each of `moves`.
    pub(super) fn run(&self, moves: &[JointTrajectory]) -> Result<Vec<Sway>, CalmError> {
        let arms: Vec<_> = moves.iter().map(|t| self.prelude.then(t)).collect();
        let candidates: Vec<Candidate<'_>> = arms
            .iter()
            .map(|arm| Candidate::new(self.rope, arm))
            .collect();
        let rollouts = roll_out(&candidates, &self.options)?;
        Ok(rollouts
            .into_iter()
            .map(|r| self.sway(r.nodes, r.outcome != Outcome::Diverged))
            .collect())
    }

    fn sway(&self, nodes: NodeTrack, finite: bool) -> Sway {
        let mut displacements_m = Vec::new();
        let mut largest_m = 0.0_f64;
        for frame in self.settled_frame..nodes.frames() {
            let [tip, middle] = self.rest.map(|(n, rest)| nodes.position(frame, n) - rest);
            largest_m = largest_m.max(tip.norm());
            displacements_m.extend(tip.iter().chain(middle.iter()));
        }
        Sway {
            displacements_m,
            largest_m,
            nodes,
            finite,
        }
    }
}

/// Tip and middle of the rope hanging still in the end pose.
fn rest(
    rope: &RopeParams,
    prelude: &Prelude,
    plain: &JointTrajectory,
) -> Result<[(usize, Vector3<f64>); 2], CalmError> {
    let held = PlannedArm::new(JointTrajectory::hold(
        plain.end() + prelude.standing_error,
        1.0,
    )?);
    let rollouts = roll_out(
        &[Candidate::new(rope, &held)],
        &SimOptions {
            step_s: STEP_S,
            precision: Precision::F64,
            start: Start::Equilibrium,
            frames: FrameTimes {
                first_s: 0.0,
                period_s: PERIOD_S,
                count: 1,
            },
            watch: Watch::NOTHING,
            horizon_s: PERIOD_S,
            threads: 1,
        },
    )?;
    let nodes = &rollouts.first().ok_or(CalmError::Diverged)?.nodes;
    let tip = nodes.nodes() - 1;
    Ok([tip, tip.div_ceil(2)].map(|n| (n, nodes.position(0, n))))
}
