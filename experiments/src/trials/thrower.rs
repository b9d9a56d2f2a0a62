//! A strike planned for one rope and thrown with another.

use arm_model::{JointTrajectory, Limits};
use planner::tasks::{
    Belief, PlanError, PlanOptions, PlanRequest, Planned, ThrowSimulator, ThrowTask, plan_throw,
    simulator_for,
};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
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
        Ok(Strikes {
            error_m: self.error_m(&planned.trajectory)?,
            predicted_m: planned.error_m,
            simulations: planned.simulations,
        })
    }

    /// With the true rope, in double precision at half the step (m).
    fn error_m(&self, trajectory: &JointTrajectory) -> Result<f64, PlanError> {
        let simulator = ThrowSimulator {
            tail_s: self.task.config().observed_s,
            ..simulator_for(self.task, &self.truth, &self.options)
        };
        let outcomes = simulator.exact().run(&[(&self.truth, trajectory)])?;
        Ok(outcomes
            .first()
            .map_or(f64::INFINITY, |o| self.task.error_m(o)))
    }
}
