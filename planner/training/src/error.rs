//! Why a step of the training failed.

use planner::features::ObserveError;
use planner::synthetic::NoiseError;
use planner::wiggle::WiggleError;
use rope_sim::SimulateError;
use std::path::{Path, PathBuf};

/// Why a step of the training failed.
#[derive(Debug, thiserror::Error)]
pub enum TrainingError {
    /// A file cannot be read or written.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file does not hold what it should.
    #[error("{}: {reason}", path.display())]
    BadFile {
        /// The file.
        path: PathBuf,
        /// What is wrong with it, and what to do.
        reason: String,
    },
    /// A value of the configuration is out of range.
    #[error("training configuration: `{key}` is {value}, but must be {expected}")]
    Value {
        /// Key in the configuration.
        key: &'static str,
        /// Value found.
        value: String,
        /// What it must be.
        expected: &'static str,
    },
    /// The noise cannot be drawn.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The wiggle cannot be made.
    #[error(transparent)]
    Wiggle(#[from] WiggleError),
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// A film gave no features.
    #[error(transparent)]
    Observe(#[from] ObserveError),
    /// The network gave numbers that are not finite.
    #[error("step {step}: the loss is {loss}; use a smaller `learning_rate`")]
    Diverged {
        /// The step.
        step: usize,
        /// The loss.
        loss: f32,
    },
    /// The tensor library failed.
    #[error("tensor library: {reason}")]
    Tensors {
        /// Its words.
        reason: String,
    },
    /// The written file does not do what the network does.
    #[error(
        "the written network differs from the trained one by {difference:.1e} in `{output}`, at most {limit:.0e} is allowed"
    )]
    NotTheSame {
        /// Name of the output.
        output: &'static str,
        /// Largest difference.
        difference: f32,
        /// Largest difference allowed.
        limit: f32,
    },
    /// The written file was refused by the program that uses it.
    #[error(transparent)]
    Model(#[from] planner::phi::ModelError),
    /// A plot cannot be drawn.
    #[error("plot {}: {reason}", path.display())]
    Plot {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
}

impl TrainingError {
    pub(crate) fn file(path: &Path, source: std::io::Error) -> Self {
        Self::File {
            path: path.to_owned(),
            source,
        }
    }

    pub(crate) fn bad_file(path: &Path, reason: impl Into<String>) -> Self {
        Self::BadFile {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }
}
