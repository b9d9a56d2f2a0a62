//! Why a step of the training failed.

use planner::features::ObserveError;
use planner::phi::ModelError;
use planner::wiggle::WiggleError;
use rope_sim::SimulateError;
use std::fmt::Display;
use std::path::Path;

pub(crate) type Result<T> = core::result::Result<T, TrainingError>;

/// Why a step of the training failed: what happened, to what, and what to do.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TrainingError {
    /// A file or a value of the configuration cannot be used.
    #[error("{0}")]
    Input(String),
    /// A model file was refused by the program that uses it.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The work itself failed.
    #[error("{0}")]
    Failed(String),
    /// The wiggle cannot be made.
    #[error(transparent)]
    Wiggle(#[from] WiggleError),
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A film gave no features.
    #[error(transparent)]
    Observe(#[from] ObserveError),
}

impl TrainingError {
    /// A file that cannot be read or written, or does not hold what it should.
    pub(crate) fn file(path: &Path, reason: impl Display) -> Self {
        Self::Input(format!("{}: {reason}", path.display()))
    }

    /// The tensor library failed.
    pub(crate) fn tensors(reason: impl Display) -> Self {
        Self::Failed(format!("tensor library: {reason}"))
    }

    /// Whether other input would help.
    pub(crate) fn is_input(&self) -> bool {
        matches!(self, Self::Input(_) | Self::Model(_))
    }
}
