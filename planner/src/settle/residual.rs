//! How much the rope still swings after a move, and how near it comes to the arm.

use super::request::SettleError;
use crate::collide::{ArmShape, RopeShape, rope_clearance_m, tool_contacts};
use crate::history::Prelude;
use arm_model::JointTrajectory;
use nalgebra::Vector3;
use rope_sim::sensitivity::{Family, Perturbation, sensitivity};
use rope_sim::{
    Candidate, FrameTimes, NodeTrack, Outcome, PlannedArm, Precision, SimOptions, roll_out,
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
    /// Nodes from the start of the move on, [`PERIOD_S`] apart.
    nodes: NodeTrack,
    /// Whether the simulation stayed finite; nothing else means anything if not.
    pub(super) finite: bool,
}

/// How [`Residual::displacements_m`] change towards each neighbouring move (m per unit).
type Slopes = Vec<Vec<f64>>;

/// Simulates one rope through moves of one duration and end pose.
#[derive(Debug)]
pub(super) struct ResidualSimulator<'a> {
    rope: &'a RopeParams,
    /// What the arm did before.
    prelude: &'a Prelude,
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
                frames: FrameTimes {
                    first_s: prelude.start_s,
                    period_s: PERIOD_S,
                    count: (shown_s / PERIOD_S).floor() as usize + 1,
                },
                threads,
                ..SimOptions::new(STEP_S, Precision::F32, prelude.start_s + shown_s)
            },
            settled_frame: (plain.duration_s() / PERIOD_S).ceil() as usize,
        })
    }

    /// Residual of the rope after each of `moves`.
    pub(super) fn run(&self, moves: &[JointTrajectory]) -> Result<Vec<Residual>, SettleError> {
        let arms: Vec<_> = moves.iter().map(|t| self.prelude.then(t)).collect();
        let candidates: Vec<Candidate<'_>> = arms
            .iter()
            .map(|arm| Candidate::new(self.rope, arm).with_sway(self.prelude.sway))
            .collect();
        let rollouts = roll_out(&candidates, &self.options)?;
        Ok(rollouts
            .into_iter()
            .map(|r| self.residual(r.nodes, r.outcome != Outcome::Diverged))
            .collect())
    }

    /// Residual after `plan` and its slopes per unit of `distance` towards each plan of `beside`;
    /// `None` where the rope diverges.
    pub(super) fn slopes(
        &self,
        plan: &JointTrajectory,
        beside: &[JointTrajectory],
        distance: f64,
    ) -> Result<Option<(Residual, Slopes)>, SettleError> {
        let here = self.prelude.then(plan);
        let arms: Vec<_> = beside.iter().map(|t| self.prelude.then(t)).collect();
        let perturbations: Vec<Perturbation<'_>> = arms
            .iter()
            .map(|motion| Perturbation::Motion { motion, distance })
            .collect();
        let family = Family {
            base: Candidate::new(self.rope, &here).with_sway(self.prelude.sway),
            perturbations: &perturbations,
        };
        let found = sensitivity(&family, &self.options)?;
        let slopes = found.slopes(|rollout| self.displacements_m(&rollout.nodes));
        let slopes: Option<Vec<_>> = slopes.into_iter().collect();
        let finite = found.base.outcome != Outcome::Diverged;
        Ok(slopes
            .filter(|_| finite)
            .map(|slopes| (self.residual(found.base.nodes, finite), slopes)))
    }

    /// Smallest gap between rope and arm or column during a move and the swing after it (m),
    /// and whether the tool side of the arm touches anything; looks at every frame.
    pub(super) fn room(&self, trajectory: &JointTrajectory, residual: &Residual) -> (f64, bool) {
        let cell = &self.prelude.cell;
        let shape = RopeShape::from(self.rope);
        let (mut gap_m, mut touches) = (f64::INFINITY, false);
        for frame in 0..residual.nodes.frames() {
            let commanded = trajectory.state_at(frame as f64 * PERIOD_S).q;
            let arm = ArmShape::at(&(commanded + self.prelude.standing_error), &cell.pole);
            let nodes: Vec<Vector3<f64>> = (0..residual.nodes.nodes())
                .map(|n| residual.nodes.position(frame, n))
                .collect();
            gap_m = gap_m.min(rope_clearance_m(&arm, cell, &shape, &nodes));
            touches |= !tool_contacts(&arm, cell).none();
        }
        (gap_m, touches)
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
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: PERIOD_S,
            count: 1,
        },
        ..SimOptions::new(STEP_S, Precision::F64, PERIOD_S)
    };
    let rollouts = roll_out(&[Candidate::new(rope, &held)], &options)?;
    let nodes = &rollouts.first().ok_or(SettleError::Diverged)?.nodes;
    let tip = nodes.nodes() - 1;
    Ok([tip, tip.div_ceil(2)].map(|n| (n, nodes.position(0, n))))
}
