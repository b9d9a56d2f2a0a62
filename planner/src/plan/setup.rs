//! What one request needs again and again, and one search with it.

use super::trajopt::{
    Found, Screen, SearchOptions, Valued, WAYPOINTS, WaypointSpace, reach_pose, search,
};
use super::{
    PlanError, PlanProgress, PlanRequest, ThrowOutcome, ThrowSimulator, ThrowTask, simulator_for,
    start_pose_for,
};
use arm_model::{JointTrajectory, JointVector};
use shared_types::RopeParams;
use std::ops::ControlFlow;

/// A point of the search's space with its trajectory.
pub(super) type Point = (Vec<f64>, JointTrajectory);

/// What one request needs again and again.
pub(super) struct Setup<'a> {
    pub(super) task: &'a dyn ThrowTask,
    pub(super) request: &'a PlanRequest,
    pub(super) space: WaypointSpace,
    pub(super) screen: Screen,
    pub(super) bounds: (Vec<f64>, Vec<f64>),
    pub(super) std_dev: Vec<f64>,
    pub(super) simulator: ThrowSimulator,
    /// The same with the step of the generations.
    searching: ThrowSimulator,
    /// The same with the whole time of observation.
    pub(super) judging: ThrowSimulator,
    pub(super) start: Vec<f64>,
    /// The rope planned for, then others that finalists are compared with.
    pub(super) ropes: Vec<RopeParams>,
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
        let config = task.config();
        let space = WaypointSpace {
            start: start_pose_for(task.target_m()),
            dimensions: request.options.dimensions,
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
        let searching = ThrowSimulator {
            step_s: request.options.search_step_s.max(simulator.step_s),
            ..simulator.clone()
        };
        let judging = ThrowSimulator {
            tail_s: config.observed_s,
            ..simulator.clone()
        };
        Ok(Self {
            bounds: space.bounds(&request.limits),
            std_dev: space.std_dev(&JointVector(config.std_dev_rad)),
            start: start_point(task, request, &space, &screen),
            ropes: config.robustness.variants(&request.rope),
            space,
            screen,
            simulator,
            searching,
            judging,
            task,
            request,
        })
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

    /// One search from its own random numbers.
    pub(super) fn search(
        &self,
        round: usize,
        count: &mut Count,
        progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
    ) -> Result<Vec<Found>, PlanError> {
        let (options, config) = (&self.request.options, self.task.config());
        let size = SearchOptions {
            start: self.start.clone(),
            population: options.population,
            generations: options.generations.unwrap_or(config.generations),
            seed: options.seed.wrapping_add((round as u64) << 40),
            std_dev: self.std_dev.clone(),
            draws_max: config.draws_max,
            stop_below_m: options.stop_below_m,
            stop_success_fraction: config.stop_success_fraction,
            keep: config.robustness.finalists,
        };
        let rope = &self.request.rope;
        let mut value = |trajectories: &[JointTrajectory]| {
            let throws: Vec<_> = trajectories.iter().map(|t| (rope, t)).collect();
            let outcomes = self.searching.run(&throws)?;
            let valued = |(t, o): (_, &ThrowOutcome)| Valued {
                fitness: self.fitness(rope, t, o),
                error_m: self.task.error_m(o),
                success: o.finite && o.contacts.none() && self.task.judge(rope, o).success,
            };
            Ok(trajectories.iter().zip(&outcomes).map(valued).collect())
        };
        let bounds = self.bounds.clone();
        let found = search(
            &self.space,
            &self.screen,
            bounds,
            &size,
            &mut value,
            progress,
        )?;
        count.simulations += found.simulations;
        count.resampled += found.resampled;
        count.interrupted |= found.interrupted;
        Ok(found.best)
    }
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
