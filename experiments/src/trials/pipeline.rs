//! The paper's simulated pipeline: strikes planned with true, identified and random
//! parameters, thrown with the true rope.

use super::strike_case::StrikeCase;
use super::thrower::Strikes;
use super::trial_rope;
use planner::plan::{PlanError, PosteriorEnsemble};
use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;

/// Keeps the ropes planned for at random apart from those thrown.
const OTHER: u64 = 0x0074_6865_7200;
/// Searches of the longer budget; three of the paper's size take about three seconds on
/// two cores.
const SEARCHES: usize = 3;

/// One rope and target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PipelineTrial {
    /// Index of the trial under its seed.
    pub index: u64,
    /// Target (m).
    pub target_m: [f64; 3],
    /// True parameters.
    pub truth: [f64; ROPE_PARAMETERS],
    /// Identified parameters.
    pub found: [f64; ROPE_PARAMETERS],
    /// Planned with the truth in one search of the paper's size.
    pub true_rope: Strikes,
    /// Planned with the truth in up to three such searches.
    pub true_rope_longer: Strikes,
    /// Planned with the identified parameters.
    pub identified: Strikes,
    /// Planned for another rope of the ranges.
    pub random: Strikes,
}

impl PipelineTrial {
    /// Plans and throws.
    ///
    /// # Errors
    /// What planning refuses.
    pub fn of(case: &StrikeCase) -> Result<Self, PlanError> {
        let (thrower, found) = (&case.thrower, case.found.params);
        let truth = thrower.truth;
        let once = thrower.plan(&truth, 1, PosteriorEnsemble::default())?;
        let true_rope = thrower.throw(&once)?;
        // A further search begins only where the first was not good enough.
        let true_rope_longer = if once.predicted_error_m <= thrower.options.good_enough_m {
            true_rope
        } else {
            thrower.throw(&thrower.plan(&truth, SEARCHES, PosteriorEnsemble::default())?)?
        };
        let other = trial_rope(case.seed ^ OTHER, case.index);
        Ok(Self {
            index: case.index,
            target_m: case.target_m,
            truth: truth.to_array(),
            found: found.to_array(),
            true_rope,
            true_rope_longer,
            identified: thrower.throw(&thrower.plan(
                &found,
                SEARCHES,
                PosteriorEnsemble::default(),
            )?)?,
            random: thrower.throw(&thrower.plan(&other, 1, PosteriorEnsemble::default())?)?,
        })
    }
}
