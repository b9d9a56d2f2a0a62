//! Why no rope was identified.

use crate::OutOfRange;
use crate::phi::{ModelError, PredictError};
use cmaes::CmaError;
use rope_sim::SimulateError;
use rope_sim::sensitivity::SensitivityError;
use shared_types::keypoints::KeypointError;
use shared_types::rope::RopeError;

/// Why no rope was identified.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The keypoints contradict themselves.
    #[error(transparent)]
    Keypoints(#[from] KeypointError),
    /// The film cannot be judged: what is wrong with it, and what to do.
    #[error("{0}")]
    Film(String),
    /// No simulated rope is in front of the camera, or every simulation failed.
    #[error(
        "no simulated rope projects into the picture: check the camera's extrinsics and the attach frame's motion"
    )]
    NothingVisible,
    /// The rope that fits the film best cannot be one.
    #[error(
        "no rope fits the film: {0}; check the camera, the motion and a weighed lead, and film again"
    )]
    NoRope(#[from] RopeError),
    /// An option is out of range.
    #[error("option {0}")]
    Option(#[from] OutOfRange),
    /// The search strategy cannot go on.
    #[error(transparent)]
    Search(#[from] CmaError),
    /// The rope simulator refused or failed.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Slopes of the simulation could not be taken.
    #[error(transparent)]
    Slopes(#[from] SensitivityError),
    /// The built-in network cannot be read.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The network gave no answer.
    #[error(transparent)]
    Network(#[from] PredictError),
    /// The caller broke off after so many generations.
    #[error("identification was cancelled after generation {0}")]
    Cancelled(usize),
}

impl IdentifyError {
    /// Whether another film or other options would help.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Keypoints(_)
                | Self::Film(_)
                | Self::NothingVisible
                | Self::NoRope(_)
                | Self::Option(_)
                | Self::Network(PredictError::Observe(_))
        )
    }
}
