//! A throw planned for one rope and thrown with another.

use arm_model::Cell;
use planner::plan::{
    PlanError, PlanOptions, PlanRequest, PosteriorEnsemble, ThrowGoal, ThrowOutcome,
    ThrowSimulator, simulator_for,
};
use serde::{Deserialize, Serialize};
use shared_types::{Plan, RopeParams};
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
#[derive(Debug)]
pub(super) struct Thrower {
    pub(super) goal: ThrowGoal,
    pub(super) options: PlanOptions,
    pub(super) truth: RopeParams,
}

impl Thrower {
    /// A throw for `rope`, or for what it might be instead.
    pub(super) fn plan(
        &self,
        rope: &RopeParams,
        searches: usize,
        ensemble: PosteriorEnsemble,
    ) -> Result<Plan, PlanError> {
        let options = PlanOptions {
            searches,
            ..self.options
        };
        let request = PlanRequest {
            ensemble,
            ..PlanRequest::new(self.goal.clone(), rope, options)
        };
        planner::plan(&request, &mut |_| ControlFlow::Continue(()))
    }

    /// What a planned throw does with the true rope.
    pub(super) fn throw(&self, planned: &Plan) -> Result<Strikes, PlanError> {
        let outcome = self.outcome(planned)?;
        Ok(Strikes {
            error_m: outcome.map_or(f64::INFINITY, |o| self.goal.task().error_m(&o)),
            predicted_m: planned.predicted_error_m,
            simulations: planned.simulations,
        })
    }

    /// With the true rope, in double precision at half the step.
    pub(super) fn outcome(&self, planned: &Plan) -> Result<Option<ThrowOutcome>, PlanError> {
        let task = self.goal.task();
        let simulator = ThrowSimulator {
            tail_s: task.config().observed_s,
            ..simulator_for(task, &self.truth, &Cell::default(), &self.options)
        };
        let throws = [(&self.truth, &planned.trajectory)];
        Ok(simulator.exact().run(&throws)?.pop())
    }
}
