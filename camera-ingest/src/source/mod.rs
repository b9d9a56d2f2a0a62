//! Recordings as sources of frames.
//!
//! Every source is randomly accessible, because each frame of the formats read
//! here stands for itself; the tracker uses that to look at frames spread over
//! the whole recording before it starts.

mod avi;
mod yuyv;

use std::path::{Path, PathBuf};

pub use avi::AviSource;
pub use yuyv::YuyvSource;

use crate::frame::{EyeFrame, FrameError, StereoFrame};

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
    #[error("video {path}: frame {frame} asked for, but it has {len}")]
    OutOfRange {
        /// File concerned.
        path: PathBuf,
        /// Index asked for.
        frame: usize,
        /// Number of frames.
        len: usize,
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

/// A recording of side-by-side frames.
pub trait FrameSource {
    /// Number of frames.
    fn len(&self) -> usize;

    /// Whether there is no frame.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Decodes one frame.
    ///
    /// # Errors
    /// The frame does not exist or is damaged.
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError>;

    /// Decodes the left eye of one frame.
    ///
    /// # Errors
    /// The frame does not exist or is damaged.
    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError> {
        self.read(index).map(|frame| frame.left())
    }
}

/// Frames that are in memory already.
impl FrameSource for Vec<StereoFrame> {
    fn len(&self) -> usize {
        Vec::len(self)
    }

    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        self.get(index)
            .cloned()
            .ok_or_else(|| SourceError::OutOfRange {
                path: PathBuf::from("(memory)"),
                frame: index,
                len: Vec::len(self),
            })
    }
}

/// Opens an AVI file, or a folder with `video.avi` and perhaps
/// `timestamps.csv`.
///
/// # Errors
/// A file is missing, truncated or of another kind.
pub fn open_video(path: &Path) -> Result<AviSource, SourceError> {
    if path.is_dir() {
        let stamps = path.join("timestamps.csv");
        let stamps = stamps.exists().then_some(stamps);
        AviSource::open(&path.join("video.avi"), stamps.as_deref())
    } else {
        AviSource::open(path, None)
    }
}

/// Decodes the left eye of every frame.
///
/// # Errors
/// A frame is damaged.
pub fn read_left(source: &mut dyn FrameSource) -> Result<Vec<EyeFrame>, SourceError> {
    (0..source.len()).map(|i| source.read_left(i)).collect()
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, SourceError> {
    std::fs::read(path).map_err(|source| SourceError::Io {
        path: path.to_owned(),
        source,
    })
}
