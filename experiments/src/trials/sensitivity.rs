//! What in a film the network's answer hangs on, rope by rope.

use super::{SensitivityMap, TrialError, TrialRig, trial_rope};
use planner::phi::{NetworkError, PhiNet};
use planner::workers::map_in_order;
use serde::{Deserialize, Serialize};

/// One filmed rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensitivityTrial {
    /// Index of the trial under its seed.
    pub index: u64,
    /// The network's sensitivities for this film.
    pub map: SensitivityMap,
}

/// Makes the trials with these indices in parallel; in their order, whatever the threads.
///
/// # Errors
/// The first trial that cannot be made.
pub fn sensitivity_trials(
    rig: &TrialRig,
    net: &PhiNet,
    seed: u64,
    indices: &[u64],
    threads: usize,
) -> Result<Vec<SensitivityTrial>, TrialError> {
    let trials = map_in_order(indices, threads, |index| {
        let index = *index;
        let failed = |source: NetworkError| TrialError::Network { index, source };
        let filmed = rig.film(&trial_rope(seed, index), seed, index)?;
        let features = net.see(&rig.observation(&filmed));
        let features = features.map_err(|e| failed(e.into()))?;
        let map = SensitivityMap::measure(net, &features);
        let map = map.map_err(|e| failed(e.into()))?;
        Ok(SensitivityTrial { index, map })
    });
    trials.into_iter().collect()
}
