//! Why a throw cannot be scored.

use crate::source::SourceError;

/// Why a throw cannot be scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// A frame cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Too few frames, frames of another size than the camera's, or a colour too grey to be
    /// found by chroma.
    #[error("score: {0}")]
    Input(String),
    /// Not found in enough frames.
    #[error(
        "score: the {what} was detected in both images of {seen} frames, at least {least} are needed; \
         check its colour, the light, and that this is the film of the throw"
    )]
    NotSeen {
        /// `tip` or `target`.
        what: &'static str,
        /// Frames it was seen in.
        seen: usize,
        /// Frames needed.
        least: usize,
    },
}

impl ScoreError {
    /// Whether film or colour cannot be scored as given; else something was looked for and
    /// not found.
    #[must_use]
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::NotSeen { .. })
    }
}
