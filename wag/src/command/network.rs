//! The network that reads rope parameters: the one inside this program, or a file.

use cli_output::{OrInput, Outcome};
use planner::identify::Method;
use planner::phi::PhiNet;
use std::path::Path;

/// The network of `model`, or the built-in one, for what a camera sees.
pub fn network(model: Option<&Path>) -> Outcome<PhiNet> {
    let net = model.map_or_else(PhiNet::embedded, PhiNet::load);
    net.or_input()?.for_camera().or_input()
}

/// Refuses a model for a method that asks no network.
pub fn no_model_without_network(method: Method, model: Option<&Path>) -> Outcome {
    match model {
        Some(path) if !method.asks_network() => Err(bad_input!(
            "--model {} is for --method nn and hybrid only",
            path.display()
        )),
        _ => Ok(()),
    }
}
