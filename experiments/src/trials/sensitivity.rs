//! What in a film the network's answer hangs on, rope by rope.

use super::{SensitivityMap, TrialError, TrialRig, trial_rope};
use planner::phi::{ModelError, NetworkError, PhiNet, PredictError};
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

/// Makes the trials with these indices, each with a network of its own from `network`, in
/// parallel; in their order, whatever the threads.
///
/// # Errors
/// The first trial that cannot be made, or what `network` refuses.
pub fn sensitivity_trials(
    rig: &TrialRig,
    network: impl Fn() -> Result<PhiNet, ModelError> + Sync,
    seed: u64,
    indices: &[u64],
    threads: usize,
) -> Result<Vec<SensitivityTrial>, TrialError> {
    let trials = map_in_order(indices, threads, |index| {
        let index = *index;
        let failed = |source: NetworkError| TrialError::Network { index, source };
        let mut net = network().map_err(|e| failed(PredictError::from(e).into()))?;
        let filmed = rig.film(&trial_rope(seed, index), seed, index)?;
        let features = net.see(&rig.observation(&filmed));
        let features = features.map_err(|e| failed(e.into()))?;
        let map = SensitivityMap::measure(&mut net, &features);
        let map = map.map_err(|e| failed(e.into()))?;
        Ok(SensitivityTrial { index, map })
    });
    trials.into_iter().collect()
}
