//! Throws planned for one rope and thrown with another, and what every table of strikes
//! begins with: a rope filmed, identified and given a target to strike.

use super::experiment::{Experiment, Sequence};
use arm_model::Cell;
use cli_output::Outcome;
use experiments::trials::{alone, in_parallel};
use planner::plan::{
    PlanError, PlanOptions, PlanRequest, PosteriorEnsemble, ThrowGoal, ThrowOutcome,
    ThrowSimulator, simulator_for,
};
use planner::ropes::{random_strike_target, trial_rope};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use shared_types::{Plan, RopeEstimate, RopeParams, Task};
use std::ops::ControlFlow;

/// What one strike did.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Strikes {
    /// Distance of tip and target with the true rope (m).
    pub error_m: f64,
    /// Distance that the plan predicted for the rope it was planned for (m).
    pub predicted_m: f64,
    /// Throws simulated to plan it.
    pub simulations: u32,
}

/// Plans for one rope and throws with another.
pub(super) struct Thrower {
    pub goal: ThrowGoal,
    pub options: PlanOptions,
    pub truth: RopeParams,
}

impl Thrower {
    /// Trial `index` at a target, on one thread, as several are made at once.
    pub fn new(
        experiment: &Experiment<'_>,
        index: u64,
        (task, target_m): (Task, [f64; 3]),
        truth: RopeParams,
    ) -> Self {
        let config = &experiment.config;
        Self {
            goal: config.goal(task, target_m),
            options: PlanOptions {
                seed: experiment.args.seed ^ index,
                threads: 1,
                ..config.search
            },
            truth,
        }
    }

    /// A throw for `rope`, or for what it might be instead.
    pub fn plan_for(
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

    /// A throw for `rope` as it is.
    pub fn plan(&self, rope: &RopeParams, searches: usize) -> Result<Plan, PlanError> {
        self.plan_for(rope, searches, PosteriorEnsemble::default())
    }

    /// What a planned throw does with the true rope.
    pub fn throw(&self, planned: &Plan) -> Result<Strikes, PlanError> {
        let outcome = self.outcome(planned)?;
        Ok(Strikes {
            error_m: outcome.map_or(f64::INFINITY, |o| self.goal.task().error_m(&o)),
            predicted_m: planned.predicted_error_m,
            simulations: planned.simulations,
        })
    }

    /// With the true rope, in double precision at half the step.
    pub fn outcome(&self, planned: &Plan) -> Result<Option<ThrowOutcome>, PlanError> {
        let task = self.goal.task();
        let simulator = ThrowSimulator {
            tail_s: task.config().observed_s,
            ..simulator_for(task, &self.truth, &Cell::default(), &self.options)
        };
        let throws = [(&self.truth, &planned.trajectory)];
        Ok(simulator.exact().run(&throws)?.pop())
    }
}

/// One rope and target.
pub(super) struct StrikeCase {
    /// Seed of the trials.
    pub seed: u64,
    /// Index of the trial under its seed.
    pub index: u64,
    pub target_m: [f64; 3],
    /// The rope as identified from its film.
    pub found: RopeEstimate,
    /// Plans, and throws with the true rope.
    pub thrower: Thrower,
}

/// The trials of a sequence, each made with `make`; none where only a shard was asked for.
pub(super) fn strike_trials<T: Send + Serialize + DeserializeOwned>(
    experiment: &Experiment<'_>,
    sequence: Sequence<T>,
    make: impl Fn(&StrikeCase) -> Result<T, PlanError> + Sync,
) -> Outcome<Option<Vec<T>>> {
    let (seed, rig, options) = (experiment.args.seed, &experiment.rig, &experiment.options);
    let trial = |index| {
        let truth = trial_rope(seed, index);
        let target_m = random_strike_target((seed << 32) ^ index);
        let filmed = rig.film(&truth, seed, index)?;
        let case = StrikeCase {
            seed,
            index,
            target_m,
            found: rig.fit(&filmed, index, &alone(options))?,
            thrower: Thrower::new(experiment, index, (Task::Strike, target_m), truth),
        };
        Ok(make(&case)?)
    };
    experiment.trials(sequence, |batch| {
        in_parallel("trial", batch, options.threads, trial)
    })
}
