//! The two places where something learned may stand in for the built-in tracker.
//!
//! [`FirstMask`] says which pixels of the first frame are rope and lead;
//! [`PointTracker`] follows points through the film. What is built in
//! ([`Moving`], the pursuit) knows the scene without rope; what is learned may
//! look at pictures only.

use super::moving::moving;
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

/// What is known when the first frame is looked at.
#[derive(Debug, Clone, Copy)]
pub struct FirstScene<'a> {
    /// The frame; the rope hangs still in it.
    pub frame: &'a EyeFrame,
    /// The scene without rope.
    pub empty: &'a EyeFrame,
    /// Brightness of the frame relative to the scene without rope.
    pub gain: f32,
    /// Typical distance of a still pixel from the scene without rope (grey levels).
    pub noise: f32,
    /// Where the rope leaves the clamp (raw pixel).
    pub clamp_px: [f64; 2],
    /// Where the lead's centre is, if somebody knows (raw pixel).
    pub lead_px: Option<[f64; 2]>,
}

/// Says which pixels of the first frame are rope and lead.
pub trait FirstMask {
    /// One value a pixel, row by row. More than the rope may be in it: what does not
    /// hang on the clamp, or lies beyond the lead, is left out later.
    ///
    /// # Errors
    /// No answer.
    fn mask(&mut self, scene: &FirstScene<'_>) -> Result<Vec<bool>, ModelError>;
}

/// What differs from the scene without rope: the built-in mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Moving;

impl FirstMask for Moving {
    fn mask(&mut self, scene: &FirstScene<'_>) -> Result<Vec<bool>, ModelError> {
        Ok(moving(scene))
    }
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

/// What stands in for the built-in tracker; by default nothing.
#[derive(Default)]
pub struct Models<'a> {
    /// For the mask of the first frame.
    pub first_mask: Option<&'a mut dyn FirstMask>,
    /// For following the rope from frame to frame.
    pub point_tracker: Option<&'a mut dyn PointTracker>,
}

impl core::fmt::Debug for Models<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Models")
            .field("first_mask", &self.first_mask.is_some())
            .field("point_tracker", &self.point_tracker.is_some())
            .finish()
    }
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
