//! Why a recording cannot be read.

use std::fmt::Display;
use std::path::Path;

use shared_types::file_error::why;

use crate::frame::FrameError;

/// Which recording cannot be read, why, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct SourceError(String);

impl SourceError {
    pub(super) fn video(path: &Path, reason: impl Display) -> Self {
        Self(format!("video {}: {reason}", path.display()))
    }

    /// The system's reason at `path`.
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::video(path, why(&source))
    }

    /// A frame, counted from 0, is damaged.
    #[must_use]
    pub fn frame(path: &Path, frame: usize, source: &FrameError) -> Self {
        Self(format!(
            "video {}, frame {frame}: {source}; record again, or cut the video before this frame",
            path.display()
        ))
    }

    /// A recording of `len` frames has no such frame.
    #[must_use]
    pub fn out_of_range(path: &Path, frame: usize, len: usize) -> Self {
        Self::video(path, format!("frame {frame} requested, but it has {len}"))
    }

    /// A line of `timestamps.csv`, counted from 1, does not fit the video.
    pub(super) fn timestamps(path: &Path, line: usize, reason: impl Display) -> Self {
        Self(format!(
            "timestamps {}, line {line}: {reason}; expected rows `frame,sequence,monotonic_ns`",
            path.display()
        ))
    }
}
