//! How much the rope still swings after a move.

use super::chain::Prelude;
use super::error::SettleError;
use arm_model::JointTrajectory;
use nalgebra::Vector3;
use rope_sim::sensitivity::{Family, Perturbation, sensitivity};
use rope_sim::{
    Candidate, FrameTimes, NodeTrack, Outcome, PlannedArm, Precision, SimOptions, Start, Watch,
    roll_out,
};
use shared_types::RopeParams;

/// Time after the move in which residual vibration is looked for (s): one period of the
/// slowest pendulum of the parameter ranges, 0.6 Hz.
const WINDOW_S: f64 = 1.6;
/// Time between looks (s): more than ten per period of the second mode.
const PERIOD_S: f64 = 1.0 / 30.0;
/// Step of the simulation (s).
const STEP_S: f64 = 1e-3;

/// The rope during and after one move.
#[derive(Debug)]
pub(super) struct Residual {
    /// Displacements of tip and middle from rest after the move, all axes (m).
    pub(super) displacements_m: Vec<f64>,
    /// Largest distance of the tip from its place at rest after the move (m).
    pub(super) largest_m: f64,
    /// Nodes from the start of the move on, [`Self::time_s`] apart.
    pub(super) nodes: NodeTrack,
    /// Whether the simulation stayed finite; nothing else means anything if not.
    pub(super) finite: bool,
}

/// Residual after one move and how neighbouring moves change it.
#[derive(Debug)]
pub(super) struct ResidualSlopes {
    /// Residual after the move.
    pub(super) residual: Residual,
    /// Slopes of [`Residual::displacements_m`] towards each neighbour (m per unit).
    pub(super) slopes: Vec<Vec<f64>>,
}

impl Residual {
    /// Time of a frame of `nodes` after the start of the move (s).
    pub(super) fn time_s(frame: usize) -> f64 {
        frame as f64 * PERIOD_S
    }
}

/// Simulates one rope through moves of one duration and end pose.
#[derive(Debug)]
pub(super) struct ResidualSimulator<'a> {
    rope: &'a RopeParams,
    /// What the arm did before.
    pub(super) prelude: &'a Prelude,
    /// Tip and middle of the rope at rest in the end pose: node and place (m).
    rest: [(usize, Vector3<f64>); 2],
    options: SimOptions,
    /// First frame after the move.
    settled_frame: usize,
}

impl<'a> ResidualSimulator<'a> {
    /// For moves that share duration and end pose with `plain`.
    pub(super) fn new(
        rope: &'a RopeParams,
        prelude: &'a Prelude,
        plain: &JointTrajectory,
        threads: usize,
    ) -> Result<Self, SettleError> {
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

    /// Residual of the rope after each of `moves`.
    pub(super) fn run(&self, moves: &[JointTrajectory]) -> Result<Vec<Residual>, SettleError> {
        let arms: Vec<_> = moves.iter().map(|t| self.prelude.then(t)).collect();
        let candidates: Vec<Candidate<'_>> = arms
            .iter()
            .map(|arm| Candidate::new(self.rope, arm))
            .collect();
        let rollouts = roll_out(&candidates, &self.options)?;
        Ok(rollouts
            .into_iter()
            .map(|r| self.residual(r.nodes, r.outcome != Outcome::Diverged))
            .collect())
    }

    /// Residual after `plan` and, per unit of `distance`, how its displacements change
    /// towards each plan of `beside`; `None` where the rope diverges.
    pub(super) fn slopes(
        &self,
        plan: &JointTrajectory,
        beside: &[JointTrajectory],
        distance: f64,
    ) -> Result<Option<ResidualSlopes>, SettleError> {
        let here = self.prelude.then(plan);
        let arms: Vec<_> = beside.iter().map(|t| self.prelude.then(t)).collect();
        let perturbations: Vec<Perturbation<'_>> = arms
            .iter()
            .map(|motion| Perturbation::Motion { motion, distance })
            .collect();
        let family = Family {
            base: Candidate::new(self.rope, &here),
            perturbations: &perturbations,
        };
        let found = sensitivity(&family, &self.options)?;
        let slopes = found.slopes(|rollout| self.displacements_m(&rollout.nodes));
        let slopes: Option<Vec<_>> = slopes.into_iter().collect();
        let finite = found.base.outcome != Outcome::Diverged;
        Ok(slopes.filter(|_| finite).map(|slopes| ResidualSlopes {
            residual: self.residual(found.base.nodes, finite),
            slopes,
        }))
    }

    fn residual(&self, nodes: NodeTrack, finite: bool) -> Residual {
        let displacements_m = self.displacements_m(&nodes);
        // Tip, then middle, per frame.
        let tips = displacements_m
            .chunks(6)
            .map(|d| Vector3::new(d[0], d[1], d[2]));
        Residual {
            largest_m: tips.map(|tip| tip.norm()).fold(0.0, f64::max),
            displacements_m,
            nodes,
            finite,
        }
    }

    /// Displacements of tip and middle from rest after the move, frame by frame (m).
    fn displacements_m(&self, nodes: &NodeTrack) -> Vec<f64> {
        (self.settled_frame..nodes.frames())
            .flat_map(|frame| {
                let [tip, middle] = self.rest.map(|(n, rest)| nodes.position(frame, n) - rest);
                [tip.x, tip.y, tip.z, middle.x, middle.y, middle.z]
            })
            .collect()
    }
}

/// Tip and middle of the rope hanging still in the end pose.
fn rest(
    rope: &RopeParams,
    prelude: &Prelude,
    plain: &JointTrajectory,
) -> Result<[(usize, Vector3<f64>); 2], SettleError> {
    let held = PlannedArm::new(
        JointTrajectory::hold(plain.end() + prelude.standing_error, 1.0)?,
        prelude.cell.pole,
    );
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
    let nodes = &rollouts.first().ok_or(SettleError::Diverged)?.nodes;
    let tip = nodes.nodes() - 1;
    Ok([tip, tip.div_ceil(2)].map(|n| (n, nodes.position(0, n))))
}
