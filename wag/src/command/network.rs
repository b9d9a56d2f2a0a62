//! The network that reads rope parameters: the one inside this program, or a file.

use anyhow::anyhow;
use cli_output::{Failure, OrInput, Outcome};
use planner::identify::Method;
use planner::phi::PhiNet;
use std::path::Path;

/// The network of `model`, or the built-in one, for what a camera sees.
///
/// # Errors
/// Why the file is refused.
pub fn network(model: Option<&Path>) -> Outcome<PhiNet> {
    let net = model.map_or_else(PhiNet::embedded, PhiNet::load);
    net.or_input()?.for_camera().or_input()
}

/// Refuses a model for a method that asks no network.
///
/// # Errors
/// What to do instead.
pub fn no_model_without_network(method: Method, model: Option<&Path>) -> Outcome {
    match model {
        Some(path) if !method.asks_network() => Err(Failure::input(anyhow!(
            "--model {} is for --method nn and hybrid only",
            path.display()
        ))),
        _ => Ok(()),
    }
}
