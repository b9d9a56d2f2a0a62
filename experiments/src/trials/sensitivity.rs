//! What in a film the network's answer depends on, rope by rope.

use super::{FailedTrial, SensitivityMap, TrialRig, in_parallel, trial_rope};
use planner::phi::{PhiNet, PredictError};
use serde::{Deserialize, Serialize};

/// One filmed rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensitivityTrial {
    /// Index of the trial under its seed.
    pub index: u64,
    /// The network's sensitivities for this film.
    pub map: SensitivityMap,
}

/// Makes the trials with these indices.
///
/// # Errors
/// The first trial that cannot be made.
pub fn sensitivity_trials(
    rig: &TrialRig,
    net: &PhiNet,
    seed: u64,
    indices: &[u64],
    threads: usize,
) -> Result<Vec<SensitivityTrial>, FailedTrial> {
    in_parallel(indices, threads, |index| {
        let filmed = rig.film(&trial_rope(seed, index), seed, index)?;
        let features = net.see(&rig.observation(&filmed));
        let map = SensitivityMap::measure(net, &features.map_err(PredictError::from)?);
        Ok(SensitivityTrial { index, map: map? })
    })
}
