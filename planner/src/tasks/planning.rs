//! From a rope and a task to a throw: searches, polish, choice among the finalists.

use super::finalists::Finalist;
use super::robust::{forecast, least_risk, search_around};
use super::setup::{Count, Setup};
use super::{Belief, PlanError, PlanOptions, PlanProgress, ThrowOutcome, ThrowTask, check_reach};
use crate::response::Following;
use arm_model::limits::LimitKind;
use arm_model::{Cell, JointTrajectory, Limits};
use shared_types::plan::trajectory_hash_hex;
use shared_types::{ErrorForecast, LimitedBy, Plan, RopeParams, Task, VERSION, Verdict};
use std::ops::ControlFlow;

/// A throw to plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanRequest {
    /// The rope, as identified or known.
    pub rope: RopeParams,
    /// What the arm may do.
    pub limits: Limits,
    /// The pole, and what stands around the arm.
    pub cell: Cell,
    /// Size of the search.
    pub options: PlanOptions,
    /// What the rope might be instead.
    pub belief: Belief,
    /// How the arm follows what it is told; none for an arm that does exactly that.
    pub following: Option<Following>,
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
    check_reach(task.target_m(), request.rope.length_m, &request.cell)?;
    let setup = Setup::new(task, request)?;
    let mut count = Count::default();
    let mut finalists: Vec<Finalist> = Vec::new();
    for round in 0..request.options.searches.max(1) {
        let found = setup.search(round, &mut count, progress)?;
        finalists.extend(setup.compare(found, &mut count)?);
        finalists.sort_by(|a, b| a.score.total_cmp(&b.score));
        if !setup.task.polishes() {
            setup.confirm(&mut finalists, &mut count)?;
        }
        let good = finalists.first().is_some_and(|f| setup.is_good(f));
        if count.interrupted || good {
            break;
        }
    }
    let is_robust = !request.belief.optimised.is_empty() && !count.interrupted;
    let chosen = if is_robust {
        let (around, simulations) = least_risk(&setup, &request.belief, finalists)?;
        count.add(simulations);
        match around {
            Some(around) => Some(setup.robust(around, &mut count, progress)?),
            None => None,
        }
    } else {
        finalists.into_iter().next()
    };
    let chosen = chosen.ok_or(PlanError::OnlyCollisions {
        simulations: count.simulations,
    })?;
    setup.finish(chosen, count)
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
    if !(options.search_step_s > 0.0 && options.search_step_s <= 5e-3) {
        return refuse(
            "search_step_s",
            options.search_step_s,
            "above 0 and at most 0.005 s",
        );
    }
    if !(1.0..=2.0).contains(&options.segment_stretch_max) {
        return refuse(
            "segment_stretch_max",
            options.segment_stretch_max,
            "from 1 to 2",
        );
    }
    if options.generations == Some(0) {
        return refuse("generations", 0.0, "1 or more");
    }
    Ok(())
}

impl Setup<'_> {
    /// The throw near a finalist that has the least risk over the believed ropes.
    fn robust(
        &self,
        around: Finalist,
        count: &mut Count,
        progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
    ) -> Result<Finalist, PlanError> {
        let (found, simulations) = search_around(self, &self.request.belief, &around, progress)?;
        count.simulations += simulations;
        let best = self.finalists(found, count)?.into_iter().next();
        Ok(best.unwrap_or(around))
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
            arm_response: request.following.as_ref().map(|f| f.source().to_owned()),
            simulations: self.simulations,
            resampled: self.resampled,
            margins: request.limits.margins(&self.trajectory),
            trajectory_sha256: trajectory_hash_hex(&self.trajectory),
            trajectory: self.trajectory,
        }
    }
}
