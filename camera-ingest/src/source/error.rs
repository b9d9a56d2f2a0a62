//! Why a recording cannot be read.

use std::path::{Path, PathBuf};

use crate::frame::FrameError;

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The file cannot be read.
    #[error("video {path}: {source} (check the path and its permissions)")]
    Io {
        /// File concerned.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The container is not what it should be.
    #[error("video {path}: {reason}; {remedy}")]
    Container {
        /// File concerned.
        path: PathBuf,
        /// What is wrong.
        reason: String,
        /// What to do.
        remedy: &'static str,
    },
    /// One frame is damaged.
    #[error(
        "video {path}, frame {frame}: {source}; record again, or cut the video before this frame"
    )]
    Frame {
        /// File concerned.
        path: PathBuf,
        /// Index of the frame, from 0.
        frame: usize,
        /// What is wrong with it.
        source: FrameError,
    },
    /// No such frame.
    #[error("video {path}: frame {frame} requested, but it has {len}")]
    OutOfRange {
        /// File concerned.
        path: PathBuf,
        /// Index asked for.
        frame: usize,
        /// Number of frames.
        len: usize,
    },
    /// The frame times are unknown, or given twice.
    #[error("video {path}: {reason}")]
    Times {
        /// File or folder concerned.
        path: PathBuf,
        /// What is wrong, and what to do.
        reason: String,
    },
    /// `timestamps.csv` does not fit the video.
    #[error(
        "timestamps {path}, line {line}: {reason}; expected rows `frame,sequence,monotonic_ns`"
    )]
    Timestamps {
        /// File concerned.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
}

impl SourceError {
    /// The system's reason at `path`.
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }
}
