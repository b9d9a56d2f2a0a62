//! Why no rope was identified.

use crate::OutOfRange;
use crate::phi::{ModelError, PredictError};
use cmaes::CmaError;
use rope_sim::SimulateError;
use rope_sim::sensitivity::SensitivityError;
use shared_types::keypoints::KeypointError;

/// Why no rope was identified.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// The keypoints contradict themselves.
    #[error(transparent)]
    Keypoints(#[from] KeypointError),
    /// The rope was lost in too many frames.
    #[error(
        "the rope was lost in {:.0} % of the frames, at most {:.0} % are allowed: film again with the whole rope in view",
        lost_fraction * 100.0, max * 100.0
    )]
    TooManyLost {
        /// Fraction of the frames in which it was lost.
        lost_fraction: f64,
        /// Fraction allowed.
        max: f64,
    },
    /// Too few frames.
    #[error("{found} frames, but identification needs {min} or more")]
    TooFewFrames {
        /// Frames found.
        found: usize,
        /// Frames needed.
        min: usize,
    },
    /// The motion of the attach frame ends before the film.
    #[error(
        "the attach frame's motion lasts {motion_s:.3} s, the film {film_s:.3} s: record the joints longer or film shorter"
    )]
    MotionTooShort {
        /// Duration of the motion (s).
        motion_s: f64,
        /// Time of the last frame (s).
        film_s: f64,
    },
    /// No simulated rope is in front of the camera, or every simulation failed.
    #[error(
        "no simulated rope projects into the picture: check the camera's extrinsics and the attach frame's motion"
    )]
    NothingVisible,
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
    Slopes(SensitivityError),
    /// The built-in network cannot be read.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The network gave no answer.
    #[error(transparent)]
    Network(#[from] PredictError),
    /// The caller broke off.
    #[error("identification was cancelled after generation {generation}")]
    Cancelled {
        /// Generations done.
        generation: usize,
    },
}

impl IdentifyError {
    /// Whether another film or other options would help.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Keypoints(_)
                | Self::TooManyLost { .. }
                | Self::TooFewFrames { .. }
                | Self::MotionTooShort { .. }
                | Self::NothingVisible
                | Self::Option(_)
                | Self::Network(PredictError::Observe(_))
        )
    }
}
