//! The paper's simulated pipeline: strikes planned with true, identified and random
//! parameters, thrown with the true rope.

use super::strike_case::{StrikeCase, strike_trials};
use super::thrower::Strikes;
use super::{TrialError, TrialRig, trial_rope};
use planner::process::PlannerConfig;
use planner::sysid::IdentifyOptions;
use planner::tasks::{Belief, PlanError};
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

fn trial(case: &StrikeCase<'_>, seed: u64) -> Result<PipelineTrial, PlanError> {
    let (thrower, found) = (&case.thrower, case.found.params);
    let truth = thrower.truth;
    let once = thrower.plan(&truth, 1, Belief::default())?;
    let true_rope = thrower.throw(&once)?;
    // A further search begins only where the first was not good enough.
    let true_rope_longer = if once.error_m <= thrower.options.good_enough_m {
        true_rope
    } else {
        thrower.throw(&thrower.plan(&truth, SEARCHES, Belief::default())?)?
    };
    let other = trial_rope(seed ^ OTHER, case.index);
    Ok(PipelineTrial {
        index: case.index,
        target_m: case.target_m,
        truth: truth.to_array(),
        found: found.to_array(),
        true_rope,
        true_rope_longer,
        identified: thrower.throw(&thrower.plan(&found, SEARCHES, Belief::default())?)?,
        random: thrower.throw(&thrower.plan(&other, 1, Belief::default())?)?,
    })
}

/// Makes the trials with these indices, in parallel; in their order, whatever the
/// threads.
///
/// # Errors
/// The first trial that cannot be made.
pub fn pipeline_trials(
    rig: &TrialRig,
    config: &PlannerConfig,
    options: &IdentifyOptions,
    seed: u64,
    indices: &[u64],
) -> Result<Vec<PipelineTrial>, TrialError> {
    strike_trials(rig, config, options, seed, indices, |case| {
        trial(case, seed)
    })
}

/// How errors spread (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub median_m: f64,
    /// Smallest.
    pub min_m: f64,
    /// Greatest.
    pub max_m: f64,
    /// 99 of 100 are below.
    pub p99_m: f64,
    /// Mean.
    pub mean_m: f64,
    /// Standard deviation.
    pub std_m: f64,
}

impl Spread {
    /// Of these errors (m); not a number for none.
    #[must_use]
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an index of the list"
    )]
    pub fn of(errors_m: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = errors_m.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len() as f64;
        let at = |part: f64| {
            let index = (part * (count - 1.0).max(0.0)).round() as usize;
            sorted.get(index).copied().unwrap_or(f64::NAN)
        };
        let mean_m = sorted.iter().sum::<f64>() / count;
        let squares: f64 = sorted.iter().map(|e| (e - mean_m).powi(2)).sum();
        Self {
            median_m: at(0.5),
            min_m: at(0.0),
            max_m: at(1.0),
            p99_m: at(0.99),
            mean_m,
            std_m: (squares / count).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_that_of_the_numbers() {
        let s = Spread::of([3.0, 1.0, 2.0, 6.0, 3.0]);
        assert_eq!(
            (s.median_m, s.min_m, s.max_m, s.mean_m),
            (3.0, 1.0, 6.0, 3.0)
        );
        assert!((s.std_m - (14.0_f64 / 5.0).sqrt()).abs() < 1e-12);
        assert!(Spread::of([]).mean_m.is_nan());
    }
}
