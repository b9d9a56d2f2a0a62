//! The network that reads rope parameters: the one inside this program, or a file.

use cli_output::{OrInput, Outcome};
use experiments::trials::TrialRig;
use planner::identify::Method;
use planner::phi::PhiNet;
use std::path::Path;
use std::sync::Arc;

/// The network of `model`, or the built-in one; a file that is refused is bad input.
pub fn network(model: Option<&Path>) -> Outcome<PhiNet> {
    match model {
        Some(path) => PhiNet::load(path).or_input(),
        None => PhiNet::embedded().or_failed(),
    }
}

/// Gives a rig the network if the method asks one, and lets it film what the network
/// reads.
/// Refuses a model for a method that asks none, and one that a fit cannot follow.
pub fn with_network(rig: &mut TrialRig, method: Method, model: Option<&Path>) -> Outcome {
    if !method.asks_network() {
        return match model {
            Some(path) => Err(bad_input!(
                "--model {} is for --method nn and hybrid only",
                path.display()
            )),
            None => Ok(()),
        };
    }
    // A fit looks at keypoints as a camera gives them.
    let net = match method {
        Method::Network => network(model)?,
        _ => network(model)?.for_camera().or_input()?,
    };
    rig.points = net.metadata().features.points;
    rig.network = Some(Arc::new(net));
    Ok(())
}
