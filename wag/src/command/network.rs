//! The network that reads rope parameters: the one inside this program, or a file.

use arm_model::Pole;
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

/// What to know where a network judges the film of another pole than it was trained with.
pub fn warning_of_pole(method: Method, pole: &Pole) -> Option<&'static str> {
    let is_other = pole.end_m() != Pole::default().end_m();
    (method.asks_network() && is_other).then_some(
        "the network was trained with the built-in pole, not with this one; compare \
         `wag identify --method hybrid-search`",
    )
}
