//! Rope parameters from the keypoints of one filmed wiggle.
//!
//! Something proposes a rope: a network, a fast search, or the paper's Φ-CMA-ES
//! ([`Method`]).
//! Gauss-Newton steps refine it against every pixel, the offset of the clocks and a
//! small error of the camera's place along with it, under a noise estimated from the
//! residuals. What the film can tell are ratios of stiffness, damping and masses
//! (multiplying all of them by one factor changes no motion), so the fit runs over
//! those, and [`scale`] adds the factor that the parameter ranges, or a weighed lead,
//! make likely. The result is a posterior over the nine parameters.

mod beyond;
mod budget;
mod camera_pose;
mod centre;
mod clock;
mod coarse;
mod coordinates;
mod descent;
mod error;
mod film;
mod fit;
mod fitted;
mod information;
mod linear;
mod network;
mod noise;
mod offsets;
mod options;
mod out_of_distribution;
mod posterior;
mod propose;
mod refine;
mod reliance;
pub mod scale;
mod search;
mod steps;
#[cfg(test)]
mod tests;

pub use error::IdentifyError;
pub use fit::WIDE;
pub use fitted::{SeenKeypoints, fitted_keypoints};
pub use information::{WiggleInformation, information};
pub use options::{IdentifyOptions, Method, tape_length_m};

use crate::observation::Observation;
use crate::phi::PhiNet;
use fit::{Start, fit};
use shared_types::RopeEstimate;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Identifies the rope, the clock offset and the camera's place from an observation, by
/// the method of the options. `network` is the one that [`Method::Network`] and
/// [`Method::Hybrid`] ask; none means the built-in one. Deterministic for a seed, whatever
/// the threads; `progress` is told after every generation or step, its value the mean
/// (Huber) distance of the best candidate so far (px).
pub fn identify(
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    network: Option<&PhiNet>,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<RopeEstimate, IdentifyError> {
    options::check(observation, options)?;
    let start = match options.method {
        Method::Cmaes => Start::Cmaes,
        Method::HybridSearch => Start::FastSearch,
        asks @ (Method::Network | Method::Hybrid) => {
            let built_in;
            let net = match network {
                Some(net) => net,
                None => {
                    built_in = PhiNet::embedded()?;
                    &built_in
                }
            };
            if asks == Method::Network {
                return network::estimate(net, observation, options);
            }
            network::proposal(net, observation)?.map_or(Start::FastSearch, Start::Proposal)
        }
    };
    let found = fit(observation, options, &start, progress)?;
    found.params.validate()?;
    Ok(found)
}
