//! The network that reads rope parameters: the one inside this program, or a file.

use crate::failure::{Failure, Outcome};
use anyhow::anyhow;
use planner::phi::{ModelError, PhiNet};
use planner::sysid::Method;
use planner::trials::TrialRig;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// The network of `model`, or the built-in one.
///
/// # Errors
/// Why it is refused: bad input where it is the file's fault.
pub fn network(model: Option<&Path>) -> Outcome<PhiNet> {
    let loaded = model.map_or_else(PhiNet::embedded, PhiNet::load);
    loaded.map_err(|error| match error {
        ModelError::Runtime { .. } | ModelError::OtherAnswer { .. } => Failure::failed(error),
        ModelError::Unreadable { .. }
        | ModelError::NotOnnx { .. }
        | ModelError::NoMetadata { .. }
        | ModelError::Unfit { .. }
        | ModelError::Damaged { .. } => Failure::input(error),
    })
}

/// Gives a rig the network if the method is to be the network.
///
/// # Errors
/// As [`network`], or a model for a method that asks none.
pub fn with_network(rig: &mut TrialRig, method: Method, model: Option<&Path>) -> Outcome {
    no_model_without_network(method, model)?;
    if method == Method::Network {
        rig.network = Some(Arc::new(Mutex::new(network(model)?)));
    }
    Ok(())
}

/// Refuses a model for a method that asks no network.
///
/// # Errors
/// What to do instead.
pub fn no_model_without_network(method: Method, model: Option<&Path>) -> Outcome {
    match model {
        Some(path) if method != Method::Network => Err(Failure::input(anyhow!(
            "--model {} is for --method nn only",
            path.display()
        ))),
        _ => Ok(()),
    }
}
