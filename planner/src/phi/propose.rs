//! The network's answer as the start of a fit.

use super::net::PhiNet;
use super::{NetworkError, PredictError};
use crate::sysid::{
    FitProgress, IdentifyError, IdentifyOptions, Method, Observation, identify_from,
};
use shared_types::{RopeEstimate, RopeParams};
use std::ops::ControlFlow;

/// Why the hybrid with a network identified no rope.
#[derive(Debug, thiserror::Error)]
pub enum HybridError {
    /// The network failed.
    #[error(transparent)]
    Network(#[from] PredictError),
    /// The fit failed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
}

/// [`identify`](crate::sysid::identify) with a network at hand: [`Method::Hybrid`] starts
/// from its answer where the film is one that it can judge. Other films and methods do
/// without it.
///
/// # Errors
/// See [`HybridError`].
pub fn identify_with_network(
    net: &PhiNet,
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    progress: &mut dyn FnMut(FitProgress) -> ControlFlow<()>,
) -> Result<RopeEstimate, HybridError> {
    let proposed = proposal(net, observation, options)?;
    Ok(identify_from(
        observation,
        proposed.as_ref(),
        options,
        progress,
    )?)
}

/// The rope that the network sees in a film; none if it cannot judge such a film or finds
/// it odd, or if the method starts by itself.
///
/// # Errors
/// Outputs that are not finite.
pub fn proposal(
    net: &PhiNet,
    observation: &Observation<'_>,
    options: &IdentifyOptions,
) -> Result<Option<RopeParams>, PredictError> {
    if options.method != Method::Hybrid {
        return Ok(None);
    }
    match net.look(observation) {
        Ok(found) if found.oddity < net.metadata().oddity_limit => {
            Ok(Some(RopeParams::from_array(found.parameters)))
        }
        Ok(found) => {
            tracing::info!(found.oddity, "the network does not know such a rope");
            Ok(None)
        }
        Err(NetworkError::Observe(reason)) => {
            tracing::info!(%reason, "the network cannot judge this film");
            Ok(None)
        }
        Err(NetworkError::Predict(error)) => Err(error),
        // Only a rope that has been simulated can be refused so.
        Err(NetworkError::Identify(_)) => Ok(None),
    }
}
