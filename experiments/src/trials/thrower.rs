//! A throw planned for one rope and thrown with another.

use arm_model::Cell;
use arm_model::Limits;
use planner::tasks::{
    Belief, PlanError, PlanOptions, PlanRequest, Planned, ThrowOutcome, ThrowSimulator, ThrowTask,
    plan_throw, simulator_for,
};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use std::fmt;
use std::ops::ControlFlow;

/// What one strike did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Strikes {
    /// Distance of tip and target with the true rope (m).
    pub error_m: f64,
    /// Distance that the plan predicted for the rope it was planned for (m).
    pub predicted_m: f64,
    /// Throws simulated to plan it.
    pub simulations: u32,
}

/// Plans for one rope and throws with another.
pub(super) struct Thrower<'a> {
    pub(super) task: &'a dyn ThrowTask,
    pub(super) options: PlanOptions,
    pub(super) truth: RopeParams,
}

impl fmt::Debug for Thrower<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Thrower").finish_non_exhaustive()
    }
}

impl Thrower<'_> {
    /// A throw for `rope`, or for what it might be instead.
    pub(super) fn plan(
        &self,
        rope: &RopeParams,
        searches: usize,
        belief: Belief,
    ) -> Result<Planned, PlanError> {
        let request = PlanRequest {
            rope: *rope,
            limits: Limits::default(),
            cell: Cell::default(),
            options: PlanOptions {
                searches,
                ..self.options
            },
            belief,
            following: None,
        };
        plan_throw(self.task, &request, &mut |_| ControlFlow::Continue(()))
    }

    /// What a planned throw does with the true rope.
    pub(super) fn throw(&self, planned: &Planned) -> Result<Strikes, PlanError> {
        let outcome = self.outcome(planned)?;
        Ok(Strikes {
            error_m: outcome.map_or(f64::INFINITY, |o| self.task.error_m(&o)),
            predicted_m: planned.error_m,
            simulations: planned.simulations,
        })
    }

    /// With the true rope, in double precision at half the step.
    pub(super) fn outcome(&self, planned: &Planned) -> Result<Option<ThrowOutcome>, PlanError> {
        let simulator = ThrowSimulator {
            tail_s: self.task.config().observed_s,
            ..simulator_for(self.task, &self.truth, &Cell::default(), &self.options)
        };
        let throws = [(&self.truth, &planned.trajectory)];
        Ok(simulator.exact().run(&throws)?.pop())
    }
}
