//! The network that reads rope parameters: the one inside this program, or a file.

use anyhow::anyhow;
use cli_output::{Failure, OrInput, Outcome};
use planner::observation::{ObserveError, ObservedPoints};
use planner::phi::PhiNet;
use planner::sysid::Method;
use std::path::Path;

/// The network of `model`, or the built-in one.
///
/// # Errors
/// Why the file is refused.
pub fn network(model: Option<&Path>) -> Outcome<PhiNet> {
    model.map_or_else(PhiNet::embedded, PhiNet::load).or_input()
}

/// [`network`] for what a camera sees.
///
/// # Errors
/// As [`network`], or a network that reads what no camera shows.
pub fn network_for_camera(model: Option<&Path>) -> Outcome<PhiNet> {
    let net = network(model)?;
    match net.metadata().features.points {
        ObservedPoints::ArcLength => Ok(net),
        ObservedPoints::LinkCentres => Err(Failure::input(ObserveError::NeedsLinkCentres)),
    }
}

/// Whether a method asks a network.
pub fn asks_network(method: Method) -> bool {
    matches!(method, Method::Network | Method::Hybrid)
}

/// Refuses a model for a method that asks no network.
///
/// # Errors
/// What to do instead.
pub fn no_model_without_network(method: Method, model: Option<&Path>) -> Outcome {
    match model {
        Some(path) if !asks_network(method) => Err(Failure::input(anyhow!(
            "--model {} is for --method nn and hybrid only",
            path.display()
        ))),
        _ => Ok(()),
    }
}
