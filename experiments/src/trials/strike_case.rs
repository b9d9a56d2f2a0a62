//! A rope filmed, identified and given a target to strike: what every table of strikes
//! begins with.

use super::thrower::Thrower;
use super::{TrialError, TrialRig, trial_rope};
use planner::process::PlannerConfig;
use planner::ropes::random_strike_target;
use planner::sysid::IdentifyOptions;
use planner::tasks::{PlanError, PlanOptions};
use planner::workers::map_in_order;
use shared_types::{RopeEstimate, Task};

/// One rope and target.
pub(super) struct StrikeCase<'a> {
    /// Index of the trial under its seed.
    pub(super) index: u64,
    /// Target (m).
    pub(super) target_m: [f64; 3],
    /// What identification made of the rope's film.
    pub(super) found: RopeEstimate,
    /// Plans, and throws with the true rope.
    pub(super) thrower: Thrower<'a>,
}

/// Makes a trial of each of these indices with `make`, in parallel; in their order,
/// whatever the threads.
///
/// # Errors
/// The first trial that cannot be made.
pub(super) fn strike_trials<T: Send>(
    rig: &TrialRig,
    config: &PlannerConfig,
    options: &IdentifyOptions,
    seed: u64,
    indices: &[u64],
    make: impl Fn(&StrikeCase<'_>) -> Result<T, PlanError> + Sync,
) -> Result<Vec<T>, TrialError> {
    let alone = IdentifyOptions {
        threads: 1,
        ..*options
    };
    let trial = |index: &u64| {
        let index = *index;
        let truth = trial_rope(seed, index);
        let target_m = random_strike_target((seed << 32) ^ index);
        let filmed = rig.film(&truth, seed, index)?;
        let task = config.task(Task::Strike, target_m);
        let case = StrikeCase {
            index,
            target_m,
            found: rig.fit(&filmed, index, &alone)?,
            thrower: Thrower {
                task: &*task,
                options: PlanOptions {
                    seed: seed ^ index,
                    threads: 1,
                    ..config.search
                },
                truth,
            },
        };
        make(&case).map_err(|source| TrialError::Plan {
            index,
            source: Box::new(source),
        })
    };
    map_in_order(indices, options.threads, trial)
        .into_iter()
        .collect()
}
