//! Where something learned may stand in for the built-in tracker: a [`PointTracker`]
//! follows points of the rope through the film.

use crate::frame::EyeFrame;

/// Why a learned model gives no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ModelError {
    /// The file cannot be read.
    #[error("model {path}: {reason} (check the path and its permissions)")]
    Unreadable {
        /// The file.
        path: String,
        /// The system's reason.
        reason: String,
    },
    /// The runtime does not take the file.
    #[error("model {path}: the network runtime does not take it: {reason}; is it an ONNX file?")]
    Refused {
        /// The file.
        path: String,
        /// The runtime's words.
        reason: String,
    },
    /// An input or output is missing, or there is one too many.
    #[error("model {path}: its {kind}s are {found}, they must be {wanted}")]
    Names {
        /// The file.
        path: String,
        /// `input` or `output`.
        kind: &'static str,
        /// What it has.
        found: String,
        /// What it must have.
        wanted: String,
    },
    /// An input or output of another type or shape.
    #[error("model {path}: {kind} `{name}` is {found}, it must be {wanted}")]
    Form {
        /// The file.
        path: String,
        /// `input` or `output`.
        kind: &'static str,
        /// Name of the input or output.
        name: &'static str,
        /// Type and shape found.
        found: String,
        /// Type and shape wanted.
        wanted: String,
    },
    /// The runtime failed, or there is none.
    #[error("model {path}: the network runtime failed: {reason}")]
    Runtime {
        /// The file.
        path: String,
        /// The runtime's words.
        reason: String,
    },
    /// Too few or too many values.
    #[error("a learned model gave {found} {what}, it must give {wanted}")]
    Count {
        /// What it gave.
        what: &'static str,
        /// So many of them.
        found: usize,
        /// So many it must give.
        wanted: usize,
    },
    /// An answer that is none.
    #[error("model {path}: its answer `{name}` has numbers that are not finite")]
    NotFinite {
        /// The file.
        path: String,
        /// Name of the output.
        name: &'static str,
    },
}

/// A followed point in one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenPoint {
    /// Raw pixel.
    pub pixel: [f64; 2],
    /// From 0 (hidden) to 1 (seen).
    pub visible: f64,
}

/// Follows points of the first frame through a film.
pub trait PointTracker {
    /// How many points it follows, where it cannot be asked for any number.
    fn points(&self) -> Option<usize>;

    /// Every point (raw pixel of frame 0) in every frame.
    ///
    /// # Errors
    /// No answer.
    fn follow(
        &mut self,
        frames: &[EyeFrame],
        points: &[[f64; 2]],
    ) -> Result<Vec<Vec<SeenPoint>>, ModelError>;
}

/// That a model gave as many values as it must.
pub(super) fn check_count(
    what: &'static str,
    found: usize,
    wanted: usize,
) -> Result<(), ModelError> {
    if found == wanted {
        return Ok(());
    }
    Err(ModelError::Count {
        what,
        found,
        wanted,
    })
}
