//! From a rope and a task to a throw: searches, polish, choice among the finalists.

use super::robust::{forecast, search_around};
use super::{
    Belief, PlanError, PlanOptions, PlanProgress, ThrowOutcome, ThrowSimulator, ThrowTask,
    check_reach, simulator_for, start_pose_for,
};
use crate::trajopt::{
    Found, Polish, Screen, SearchOptions, Valued, WAYPOINTS, WaypointSpace, polish, reach_pose,
    search,
};
use rope_sim::FrameTimes;
use shared_types::limits::LimitKind;
use shared_types::plan::trajectory_hash_hex;
use shared_types::{
    ErrorForecast, JointTrajectory, LimitedBy, Limits, Plan, RopeParams, Task, VERSION, Verdict,
};
use std::ops::ControlFlow;

/// A throw to plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// The rope, as identified or known.
    pub rope: RopeParams,
    /// What the arm may do.
    pub limits: Limits,
    /// Size of the search.
    pub options: PlanOptions,
    /// What the rope might be instead.
    pub belief: Belief,
}

/// A planned throw.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// The throw.
    pub trajectory: JointTrajectory,
    /// What it does in double precision at half the step.
    pub outcome: ThrowOutcome,
    /// The task's error (m).
    pub error_m: f64,
    /// What the task makes of it.
    pub verdict: Verdict,
    /// Its fitness.
    pub fitness: f64,
    /// Error to expect over the believed ropes.
    pub forecast: Option<ErrorForecast>,
    /// What keeps it from being better.
    pub limited_by: LimitedBy,
    /// Whether `progress` broke the search off.
    pub interrupted: bool,
    /// Throws simulated.
    pub simulations: u32,
    /// Candidates drawn again because they broke a limit.
    pub resampled: u32,
}

/// A point of the search's space with its trajectory.
pub(super) type Point = (Vec<f64>, JointTrajectory);

/// A throw that is compared at the end.
#[derive(Debug, Clone)]
pub(super) struct Finalist {
    pub(super) x: Vec<f64>,
    pub(super) trajectory: JointTrajectory,
    /// Outcome with the rope planned for.
    outcome: ThrowOutcome,
    /// Smaller is better.
    score: f64,
    /// Part of the ropes compared with which the task succeeds.
    successes: f64,
}

/// What one request needs again and again.
pub(super) struct Setup<'a> {
    pub(super) task: &'a dyn ThrowTask,
    pub(super) request: &'a PlanRequest,
    pub(super) space: WaypointSpace,
    pub(super) screen: Screen,
    pub(super) bounds: (Vec<f64>, Vec<f64>),
    pub(super) std_dev_rad: Vec<f64>,
    pub(super) simulator: ThrowSimulator,
    /// The same with the whole time of observation.
    pub(super) judging: ThrowSimulator,
    pub(super) start: Vec<f64>,
    /// The rope planned for, then others that finalists are compared with.
    ropes: Vec<RopeParams>,
}

/// Plans a throw. Deterministic for a seed, whatever the threads. Broken off by
/// `progress`, it plans with what has been found up to then.
///
/// # Errors
/// See [`PlanError`]; an unreachable target is refused before any simulation.
pub fn plan_throw(
    task: &dyn ThrowTask,
    request: &PlanRequest,
    progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
) -> Result<Planned, PlanError> {
    request.rope.validate()?;
    check_options(&request.options)?;
    check_reach(task.target_m(), request.rope.length_m)?;
    let setup = Setup::new(task, request)?;
    let mut count = Count::default();
    let mut finalists: Vec<Finalist> = Vec::new();
    for round in 0..request.options.searches.max(1) {
        let found = setup.search(round, &mut count, progress)?;
        finalists.extend(setup.compare(found, &mut count)?);
        finalists.sort_by(|a, b| a.score.total_cmp(&b.score));
        let good = finalists.first().is_some_and(|f| setup.is_good(f));
        if count.interrupted || good {
            break;
        }
    }
    let mut chosen = finalists
        .into_iter()
        .next()
        .ok_or(PlanError::OnlyCollisions {
            simulations: count.simulations,
        })?;
    if !request.belief.optimised.is_empty() && !count.interrupted {
        let (found, simulations) = search_around(&setup, &request.belief, &chosen, progress)?;
        count.simulations += simulations;
        if let Some(f) = setup.finalists(found, &mut count)?.into_iter().next() {
            chosen = f;
        }
    }
    setup.finish(chosen, count)
}

/// What was spent.
#[derive(Default)]
struct Count {
    simulations: u32,
    resampled: u32,
    interrupted: bool,
}

impl Count {
    fn add(&mut self, simulations: usize) {
        self.simulations += u32::try_from(simulations).unwrap_or(u32::MAX);
    }
}

fn check_options(options: &PlanOptions) -> Result<(), PlanError> {
    let refuse = |option, value, expected| {
        Err(PlanError::Option {
            option,
            value,
            expected,
        })
    };
    if !(options.step_s > 0.0 && options.step_s <= 5e-3) {
        return refuse("step_s", options.step_s, "above 0 and at most 0.005 s");
    }
    if options.generations == Some(0) {
        return refuse("generations", 0.0, "1 or more");
    }
    Ok(())
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
        };
        let screen = Screen::new(space.clone(), request.limits.clone(), config.clearance)?;
        let simulator = simulator_for(task, &request.rope, &request.options);
        let judging = ThrowSimulator {
            tail_s: config.observed_s,
            ..simulator.clone()
        };
        let joints = space.dimensions.joints();
        Ok(Self {
            bounds: space.bounds(&request.limits),
            std_dev_rad: (0..WAYPOINTS)
                .flat_map(|_| joints.iter().map(|&j| config.std_dev_rad[j]))
                .collect(),
            start: start_point(task, &request.rope, &space, &screen),
            ropes: config.robustness.variants(&request.rope),
            space,
            screen,
            simulator,
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
    fn search(
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
            std_dev_rad: self.std_dev_rad.clone(),
            draws_max: config.draws_max,
            stop_below_m: options.stop_below_m,
            stop_success_part: config.stop_success_part,
            keep: config.robustness.finalists,
        };
        let rope = &self.request.rope;
        let mut value = |trajectories: &[JointTrajectory]| {
            let throws: Vec<_> = trajectories.iter().map(|t| (rope, t)).collect();
            let outcomes = self.simulator.run(&throws)?;
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

    /// The best of a search with all ropes; the best of those polished.
    fn compare(&self, found: Vec<Found>, count: &mut Count) -> Result<Vec<Finalist>, PlanError> {
        let points = found.into_iter().map(|f| (f.x, f.trajectory)).collect();
        let mut finalists = self.finalists(points, count)?;
        if self.task.polishes() {
            let best = finalists
                .iter()
                .take(self.task.config().robustness.polished);
            let points: Vec<Vec<f64>> = best.map(|f| f.x.clone()).collect();
            let frames = FrameTimes::NONE;
            let motion_s = self.space.times_s[WAYPOINTS - 1];
            let work = Polish {
                space: &self.space,
                screen: &self.screen,
                rope: &self.request.rope,
                slopes: &self.simulator.options(motion_s, frames),
                exact: &self.simulator.exact().options(motion_s, frames),
                seed: self.request.options.seed,
            };
            let (polished, simulations) = polish(&work, &points)?;
            count.add(simulations);
            let points = polished
                .into_iter()
                .map(|p| Ok((p.x.clone(), self.space.decode(&p.x)?)))
                .collect::<Result<Vec<_>, PlanError>>()?;
            finalists.extend(self.finalists(points, count)?);
            finalists.sort_by(|a, b| a.score.total_cmp(&b.score));
        }
        Ok(finalists)
    }

    /// Throws observed to the end with all ropes, the best first. One that lets the arm
    /// collide is none.
    fn finalists(&self, points: Vec<Point>, count: &mut Count) -> Result<Vec<Finalist>, PlanError> {
        let throws: Vec<_> = points
            .iter()
            .flat_map(|(_, t)| self.ropes.iter().map(move |rope| (rope, t)))
            .collect();
        let mut outcomes = self.judging.run(&throws)?;
        count.add(throws.len());
        let mut out = Vec::new();
        for (x, trajectory) in points {
            let own: Vec<ThrowOutcome> = outcomes.drain(..self.ropes.len()).collect();
            if !own[0].finite || own[0].contacts.pole_robot > 0 {
                continue;
            }
            out.push(self.finalist(x, trajectory, own));
        }
        out.sort_by(|a, b| a.score.total_cmp(&b.score));
        Ok(out)
    }

    fn finalist(
        &self,
        x: Vec<f64>,
        trajectory: JointTrajectory,
        outcomes: Vec<ThrowOutcome>,
    ) -> Finalist {
        #[allow(clippy::cast_precision_loss, reason = "a handful of ropes")]
        let count = outcomes.len().max(1) as f64;
        let squares: f64 = outcomes.iter().map(|o| self.task.error_m(o).powi(2)).sum();
        let good = self.ropes.iter().zip(&outcomes);
        let good = good.filter(|(rope, o)| o.finite && self.task.judge(rope, o).success);
        #[allow(clippy::cast_precision_loss, reason = "a handful of ropes")]
        let successes = good.count() as f64 / count;
        let contacts = self.task.config().weights.contacts(&outcomes[0].contacts);
        Finalist {
            x,
            trajectory,
            score: (squares / count).sqrt() + contacts + (1.0 - successes),
            successes,
            outcome: outcomes.into_iter().next().unwrap_or_default(),
        }
    }

    /// Whether no further search is needed.
    fn is_good(&self, finalist: &Finalist) -> bool {
        // All but one of the ropes compared.
        const SUCCESSES: f64 = 0.85;
        let error_m = self.task.error_m(&finalist.outcome);
        let close = !self.task.polishes() || error_m <= self.request.options.good_enough_m;
        close && finalist.successes >= SUCCESSES && finalist.outcome.contacts.none()
    }

    /// The prediction comes from double precision at half the step.
    fn finish(&self, chosen: Finalist, mut count: Count) -> Result<Planned, PlanError> {
        let trajectory = chosen.trajectory;
        let limits = &self.request.limits;
        if let Some(margin) = limits.worst_violation(&trajectory) {
            return Err(PlanError::BreaksLimit {
                what: margin.describe(),
            });
        }
        let rope = &self.request.rope;
        let exact = self.judging.exact().run(&[(rope, &trajectory)])?;
        count.add(1);
        let exact = exact.into_iter().find(|o| o.finite);
        let outcome = exact.unwrap_or(chosen.outcome);
        let forecast = forecast(self, &self.request.belief, &trajectory)?;
        count.add(self.request.belief.forecast.len());
        let error_m = self.task.error_m(&outcome);
        let verdict = self.task.judge(rope, &outcome);
        Ok(Planned {
            error_m,
            fitness: self.fitness(rope, &trajectory, &outcome),
            limited_by: self.limited_by(&trajectory, &outcome, &verdict),
            verdict,
            forecast,
            outcome,
            trajectory,
            interrupted: count.interrupted,
            simulations: count.simulations,
            resampled: count.resampled,
        })
    }

    fn limited_by(
        &self,
        trajectory: &JointTrajectory,
        outcome: &ThrowOutcome,
        verdict: &Verdict,
    ) -> LimitedBy {
        // Plans use 98.5 % of each limit; this much more is hardly room.
        const LEFT_PART: f64 = 0.03;
        let error_m = self.task.error_m(outcome);
        let close = !self.task.polishes() || error_m <= self.request.options.good_enough_m;
        if !outcome.contacts.none() {
            return LimitedBy::Contact;
        }
        if verdict.success && close {
            return LimitedBy::Nothing;
        }
        let margins = self.request.limits.margins(trajectory);
        let is_range = |k: LimitKind| matches!(k, LimitKind::PositionMin | LimitKind::PositionMax);
        let used = |range: bool| {
            margins
                .iter()
                .any(|m| is_range(m.kind) == range && m.left < LEFT_PART * m.limit.abs().max(1e-3))
        };
        match () {
            () if used(true) => LimitedBy::JointRange,
            () if used(false) => LimitedBy::ArmSpeed,
            () => LimitedBy::Budget,
        }
    }
}

/// The task's warm start, as far from rest as the arm may go; rest without one.
fn start_point(
    task: &dyn ThrowTask,
    rope: &RopeParams,
    space: &WaypointSpace,
    screen: &Screen,
) -> Vec<f64> {
    const PARTS: u32 = 20;
    let resting = space.resting();
    let poses = task.warm_start(rope);
    if poses.len() != WAYPOINTS {
        return resting;
    }
    let joints = space.dimensions.joints();
    let wanted: Vec<f64> = poses
        .iter()
        .scan(space.start, |from, pose| {
            *from = reach_pose(from, *pose);
            Some(*from)
        })
        .flat_map(|q| joints.iter().map(move |&j| q[j]))
        .collect();
    (0..PARTS)
        .map(|i| 1.0 - f64::from(i) / f64::from(PARTS))
        .map(|part| {
            let between = |(r, w): (&f64, &f64)| r + part * (w - r);
            resting.iter().zip(&wanted).map(between).collect()
        })
        .find(|x: &Vec<f64>| screen.accepts(x))
        .unwrap_or(resting)
}

impl Planned {
    /// The plan as it is written down.
    #[must_use]
    pub fn into_plan(self, kind: Task, task: &dyn ThrowTask, request: &PlanRequest) -> Plan {
        Plan {
            version: VERSION.to_owned(),
            seed: request.options.seed,
            task: kind,
            target_m: task.target_m(),
            rope: request.rope,
            predicted_error_m: self.error_m,
            predicted_time_s: self.outcome.closest_s,
            fitness: self.fitness,
            interrupted: self.interrupted,
            limited_by: Some(self.limited_by),
            verdict: self.verdict,
            forecast: self.forecast,
            simulations: self.simulations,
            resampled: self.resampled,
            margins: request.limits.margins(&self.trajectory),
            trajectory_sha256: trajectory_hash_hex(&self.trajectory),
            trajectory: self.trajectory,
        }
    }
}
