//! What one request needs again and again.

use super::pole_pose::reach_pose;
use super::screen::Screen;
use super::waypoints::{WAYPOINTS, WaypointSpace};
use super::{
    PlanError, PlanRequest, RopeAtStart, ThrowOutcome, ThrowSimulator, ThrowTask, simulator_for,
    start_pose_for,
};
use crate::collide::Block;
use crate::history::{ArmHistory, HistoryError, Prelude};
use arm_model::geometry::Capsule;
use arm_model::{Cell, JointTrajectory, JointVector};
use nalgebra::Vector3;
use rope_sim::Precision;
use shared_types::{RopeParams, RopeState};

/// A point of the search's space with its trajectory.
pub(super) type Point = (Vec<f64>, JointTrajectory);

/// What one request needs again and again.
pub(super) struct Setup<'a> {
    pub(super) task: &'a dyn ThrowTask,
    pub(super) request: &'a PlanRequest,
    pub(super) space: WaypointSpace,
    pub(super) screen: Screen,
    pub(super) std_dev: Vec<f64>,
    pub(super) simulator: ThrowSimulator,
    /// The same with the step of the generations.
    pub(super) searching: ThrowSimulator,
    /// The same with the whole time of observation.
    pub(super) judging: ThrowSimulator,
    pub(super) start: Vec<f64>,
    /// The rope planned for, then others that finalists are compared with.
    pub(super) ropes: Vec<RopeParams>,
    /// Their states when the throw begins; empty where they hang still.
    pub(super) states: Vec<RopeState>,
    prelude: Option<Prelude>,
}

/// Most by which a throw of a rope that curls or swings is turned away from the target's bearing
/// (rad): what the tip of such a rope hangs aside, as seen from the base axis.
const TURN_MAX_RAD: f64 = 0.3;

/// Whether a rope at rest leaves the vertical plane of the throw by more than a millimetre or
/// so.
fn curls(rope: &RopeParams) -> bool {
    const CURVATURE_MIN_PER_M: f64 = 0.02;
    let [x, y, _] = rope.beyond().rest_curvature_per_m;
    x.hypot(y) > CURVATURE_MIN_PER_M
}

/// What was spent.
#[derive(Default)]
pub(super) struct Count {
    pub(super) simulations: u32,
    pub(super) resampled: u32,
    pub(super) interrupted: bool,
}

impl Count {
    pub(super) fn add(&mut self, simulations: usize) {
        self.simulations += u32::try_from(simulations).unwrap_or(u32::MAX);
    }
}

/// Sum over joints of the way from knot to knot, `M` of the paper's appendix (rad).
pub(super) fn joint_motion_rad(trajectory: &JointTrajectory) -> f64 {
    trajectory
        .waypoints()
        .windows(2)
        .map(|w| (w[1] - w[0]).iter().map(|d| d.abs()).sum::<f64>())
        .sum()
}

impl<'a> Setup<'a> {
    pub(super) fn new(
        task: &'a dyn ThrowTask,
        request: &'a PlanRequest,
    ) -> Result<Self, PlanError> {
        Self::from_states(task, request, None)
    }

    /// The same where the states of the ropes when the throw begins are known.
    pub(super) fn from_states(
        task: &'a dyn ThrowTask,
        request: &'a PlanRequest,
        states: Option<Vec<RopeState>>,
    ) -> Result<Self, PlanError> {
        let config = task.config();
        let space = WaypointSpace {
            start: start_pose_for(task.target_m()),
            dimensions: request.options.dimensions,
            turn_max_rad: if curls(&request.rope) || request.before.is_some() {
                TURN_MAX_RAD
            } else {
                0.0
            },
            stands: request.before.is_some(),
            times_s: config.waypoint_times_s,
            stretch_max: request.options.segment_stretch_max,
        };
        let screen = Screen::new(
            space.clone(),
            request.limits.clone(),
            request.cell,
            config.clearance,
        )?;
        let simulator = ThrowSimulator {
            following: request.following.clone(),
            ..simulator_for(task, &request.rope, &request.cell, &request.options)
        };
        let clamp_m = request.cell.pole.attach_pose(&space.start).0;
        let tip_m = clamp_m - Vector3::z() * request.rope.length_m;
        let hanging = |a_m, radius_m| Capsule {
            a_m,
            b_m: tip_m,
            radius_m,
        };
        let hanging = [
            hanging(clamp_m, request.rope.radius_m),
            hanging(tip_m, request.rope.lead_radius_m),
        ];
        let is_free = |block: &Block| hanging.iter().all(|part| block.gap_m(part) > 0.0);
        if !simulator.keep_clear.iter().all(is_free) {
            return Err(PlanError::Target(format!(
                "what the {} is thrown at would stand where the rope hangs before the throw: move the target farther from the arm",
                request.goal.kind().name()
            )));
        }
        let searching = ThrowSimulator {
            step_s: request.options.search_step_s.max(simulator.step_s),
            ..simulator.clone()
        };
        let judging = ThrowSimulator {
            tail_s: config.observed_s,
            ..simulator.clone()
        };
        let before = request.before.as_ref();
        let prelude = before.map(|history| prelude_of(history, &space.start, &request.cell));
        let mut setup = Self {
            std_dev: space.std_dev(&JointVector(config.std_dev_rad)),
            start: start_point(task, request, &space, &screen),
            ropes: config.robustness.variants(&request.rope),
            states: Vec::new(),
            prelude: prelude.transpose()?,
            space,
            screen,
            simulator,
            searching,
            judging,
            task,
            request,
        };
        setup.states = match states {
            Some(states) => states,
            None => setup.led_to(&setup.ropes)?,
        };
        Ok(setup)
    }

    /// The rope planned for and the others, as the throw begins.
    pub(super) fn at_start(&self) -> impl Iterator<Item = RopeAtStart<'_>> + Clone {
        at_start(&self.ropes, &self.states)
    }

    /// The rope planned for, as the throw begins.
    pub(super) fn own(&self) -> RopeAtStart<'_> {
        RopeAtStart {
            rope: &self.request.rope,
            state: self.states.first(),
        }
    }

    /// Where what the arm did before leads some ropes; nothing where they hang still.
    ///
    /// # Errors
    /// What the simulator refuses; the simulation of one diverges.
    pub(super) fn led_to(&self, ropes: &[RopeParams]) -> Result<Vec<RopeState>, PlanError> {
        let states = self.may_lead_to(ropes, Precision::F64)?.into_iter();
        let states = states.collect::<Option<_>>();
        Ok(states.ok_or(HistoryError::Diverged)?)
    }

    /// The same; none for a rope whose simulation diverges.
    pub(super) fn may_lead_to(
        &self,
        ropes: &[RopeParams],
        precision: Precision,
    ) -> Result<Vec<Option<RopeState>>, PlanError> {
        let Some(prelude) = &self.prelude else {
            return Ok(Vec::new());
        };
        Ok(prelude.lead_to(ropes, (precision, self.request.options.threads))?)
    }

    /// Fitness `f(τ)` of one simulated throw.
    pub(super) fn fitness(
        &self,
        rope: &RopeParams,
        trajectory: &JointTrajectory,
        outcome: &ThrowOutcome,
    ) -> f64 {
        // A simulation that blew up ranks behind every one that did not.
        const DIVERGED: f64 = 1e3;
        if !outcome.finite {
            return DIVERGED;
        }
        let weights = &self.task.config().weights;
        self.task.fitness(rope, outcome)
            + weights.motion_per_rad * joint_motion_rad(trajectory)
            + weights.speed_excess_per_rad_s * self.screen.speed_excess_rad_s(trajectory)
            + weights.contacts(&outcome.contacts)
    }
}

/// Ropes with their states, if they have any.
pub(super) fn at_start<'a>(
    ropes: &'a [RopeParams],
    states: &'a [RopeState],
) -> impl Iterator<Item = RopeAtStart<'a>> + Clone {
    let numbered = ropes.iter().enumerate();
    numbered.map(|(i, rope)| RopeAtStart {
        rope,
        state: states.get(i),
    })
}

/// What the arm did before a throw from the pose `start`.
fn prelude_of(
    history: &ArmHistory,
    start: &JointVector,
    cell: &Cell,
) -> Result<Prelude, HistoryError> {
    const TOLERANCE_RAD: f64 = 1e-6;
    if (history.start_q - *start).max_abs() > TOLERANCE_RAD {
        return Err(HistoryError::Start(
            "the arm stands elsewhere than this throw begins: wiggle in its start pose".to_owned(),
        ));
    }
    Prelude::new(history, cell)
}

/// The task's warm start, as far from rest as the arm may go; rest without one.
fn start_point(
    task: &dyn ThrowTask,
    request: &PlanRequest,
    space: &WaypointSpace,
    screen: &Screen,
) -> Vec<f64> {
    const STEPS: u32 = 20;
    let resting = space.resting();
    let poses = task.warm_start(&request.rope);
    if poses.len() != WAYPOINTS {
        return resting;
    }
    let joints = space.dimensions.joints();
    let mut wanted: Vec<f64> = poses
        .iter()
        .scan(space.start, |from, pose| {
            *from = reach_pose(from, *pose, &request.cell.pole);
            Some(*from)
        })
        .flat_map(|q| joints.iter().map(move |&j| q[j]))
        .collect();
    wanted.resize(resting.len(), 0.0);
    (0..STEPS)
        .map(|i| 1.0 - f64::from(i) / f64::from(STEPS))
        .map(|fraction| {
            let between = |(r, w): (&f64, &f64)| r + fraction * (w - r);
            resting.iter().zip(&wanted).map(between).collect()
        })
        .find(|x: &Vec<f64>| screen.accepts(x))
        .unwrap_or(resting)
}
