//! From a rope and a task to a throw: searches, polish, choice among the finalists.

use super::finalists::{Finalist, best_first};
use super::plausible::check_payload;
use super::setup::{Count, Setup};
use super::{PlanError, PlanRequest, ThrowOutcome, ThrowTask, check_reach, clear_of_arm};
use arm_model::JointTrajectory;
use arm_model::limits::LimitKind;
use shared_types::ipc::message::Progress;
use shared_types::plan::trajectory_hash_hex;
use shared_types::{LimitedBy, Plan, VERSION, Verdict};
use std::ops::ControlFlow;

/// Plans a throw. Deterministic for a seed, whatever the threads. `progress` is told
/// of every generation, and once of the library's throws; interrupted by it, the throw is planned
/// with what has been found.
///
/// # Errors
/// See [`PlanError`]; an unreachable target is refused before any simulation.
pub fn plan(
    request: &PlanRequest,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Plan, PlanError> {
    plan_task(request.goal.task(), request, progress)
}

/// [`plan`] for a task of one's own, which is written down as the request's goal.
///
/// # Errors
/// As [`plan`].
pub fn plan_task(
    task: &dyn ThrowTask,
    request: &PlanRequest,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<Plan, PlanError> {
    check(task, request)?;
    let setup = Setup::new(task, request)?;
    let mut count = Count::default();
    if let Some(plan) = setup.recalled(&mut count, progress)? {
        return Ok(plan);
    }
    let mut finalists: Vec<Finalist> = Vec::new();
    let polished = setup.task.config().robustness.polished;
    for round in 0..request.options.searches.max(1) {
        let found = setup.search(round, &mut count, progress)?;
        finalists.extend(setup.compare(found, polished, &mut count)?);
        best_first(&mut finalists);
        if !setup.task.polishes() {
            setup.confirm(&mut finalists, &mut count)?;
        }
        let good = finalists.first().is_some_and(|f| setup.is_good(f));
        if count.interrupted || good {
            break;
        }
    }
    let chosen = if request.ensemble.optimised.is_empty() || count.interrupted {
        finalists.into_iter().next()
    } else {
        setup.robust(finalists, &mut count, progress)?
    };
    let chosen = chosen.ok_or(PlanError::OnlyCollisions(count.simulations))?;
    setup.finish(chosen, &mut count)
}

/// Refuses what cannot be planned, before any simulation.
pub(super) fn check(task: &dyn ThrowTask, request: &PlanRequest) -> Result<(), PlanError> {
    request.rope.validate()?;
    check_payload(&request.rope)?;
    request.options.check()?;
    task.config().check()?;
    request.goal.check()?;
    check_reach(task.target_m(), request.rope.length_m, &request.cell)?;
    clear_of_arm(task.target_m(), &request.cell)
}

impl Setup<'_> {
    /// The plan of the throw that was chosen.
    pub(super) fn finish(&self, chosen: Finalist, count: &mut Count) -> Result<Plan, PlanError> {
        let exact = self.exact_outcome(&chosen.trajectory, count)?;
        let outcome = exact.unwrap_or(chosen.outcome);
        self.written(chosen.trajectory, &outcome, count)
    }

    /// What a throw does with the rope planned for, in double precision at half the step; `None`
    /// if the simulation diverges.
    pub(super) fn exact_outcome(
        &self,
        trajectory: &JointTrajectory,
        count: &mut Count,
    ) -> Result<Option<ThrowOutcome>, PlanError> {
        count.add(1);
        let throws = [(self.own(), trajectory)];
        let outcomes = self.judging.exact().run(&throws)?;
        Ok(outcomes.into_iter().find(|o| o.finite))
    }

    /// The plan as it is written down.
    pub(super) fn written(
        &self,
        trajectory: JointTrajectory,
        outcome: &ThrowOutcome,
        count: &mut Count,
    ) -> Result<Plan, PlanError> {
        let request = self.request;
        if let Some(margin) = request.limits.worst_violation(&trajectory) {
            return Err(PlanError::BreaksLimit(margin.describe()));
        }
        let rope = &request.rope;
        let forecast = self.forecast(&trajectory)?;
        count.add(request.ensemble.forecast.len());
        let verdict = self.task.judge(rope, outcome);
        Ok(Plan {
            version: VERSION.to_owned(),
            seed: request.options.seed,
            task: request.goal.kind(),
            target_m: self.task.target_m(),
            aim: None,
            rope: *rope,
            start: self.states.first().cloned(),
            cell: Some(request.cell),
            predicted_error_m: self.task.error_m(outcome),
            predicted_time_s: outcome.closest_s,
            fitness: self.fitness(rope, &trajectory, outcome),
            interrupted: count.interrupted,
            limited_by: Some(self.limited_by(&trajectory, outcome, &verdict)),
            verdict,
            forecast,
            unconfirmed: Vec::new(),
            arm_response: request.following.as_ref().map(|f| f.source().to_owned()),
            simulations: count.simulations,
            resampled: count.resampled,
            margins: request.limits.margins(&trajectory),
            trajectory_sha256: trajectory_hash_hex(&trajectory),
            trajectory,
        })
    }

    fn limited_by(
        &self,
        trajectory: &JointTrajectory,
        outcome: &ThrowOutcome,
        verdict: &Verdict,
    ) -> LimitedBy {
        // Plans use 98.5 % of each limit; this much more is hardly room.
        const LEFT_FRACTION: f64 = 0.03;
        if !outcome.contacts.none() {
            return LimitedBy::Contact;
        }
        if verdict.success && self.is_close(outcome) {
            return LimitedBy::Nothing;
        }
        let margins = self.request.limits.margins(trajectory);
        let is_range = |k: LimitKind| matches!(k, LimitKind::PositionMin | LimitKind::PositionMax);
        let used: Vec<bool> = margins
            .iter()
            .filter(|m| m.left < LEFT_FRACTION * m.limit.abs().max(1e-3))
            .map(|m| is_range(m.kind))
            .collect();
        if used.contains(&true) {
            LimitedBy::JointRange
        } else if used.is_empty() {
            LimitedBy::Budget
        } else {
            LimitedBy::ArmSpeed
        }
    }
}
