//! A rope filmed, identified and given a target to strike: what every table of strikes
//! begins with.

use super::thrower::Thrower;
use super::{FailedTrial, TrialRig, alone, in_parallel, trial_rope};
use planner::PlannerConfig;
use planner::identify::IdentifyOptions;
use planner::plan::{PlanError, PlanOptions};
use planner::ropes::random_strike_target;
use shared_types::{RopeEstimate, Task};

/// One rope and target.
#[derive(Debug)]
pub struct StrikeCase {
    /// Seed of the trials.
    pub(super) seed: u64,
    /// Index of the trial under its seed.
    pub(super) index: u64,
    /// Target (m).
    pub(super) target_m: [f64; 3],
    /// The rope as identified from its film.
    pub(super) found: RopeEstimate,
    /// Plans, and throws with the true rope.
    pub(super) thrower: Thrower,
}

/// Makes a trial of each of these indices with `make`.
///
/// # Errors
/// The first trial that cannot be made.
pub fn strike_trials<T: Send>(
    rig: &TrialRig,
    config: &PlannerConfig,
    options: &IdentifyOptions,
    indices: &[u64],
    make: impl Fn(&StrikeCase) -> Result<T, PlanError> + Sync,
) -> Result<Vec<T>, FailedTrial> {
    let seed = options.seed;
    in_parallel(indices, options.threads, |index| {
        let truth = trial_rope(seed, index);
        let target_m = random_strike_target((seed << 32) ^ index);
        let filmed = rig.film(&truth, seed, index)?;
        let case = StrikeCase {
            seed,
            index,
            target_m,
            found: rig.fit(&filmed, index, &alone(options))?,
            thrower: Thrower {
                goal: config.goal(Task::Strike, target_m),
                options: PlanOptions {
                    seed: seed ^ index,
                    threads: 1,
                    ..config.search
                },
                truth,
            },
        };
        Ok(make(&case)?)
    })
}
