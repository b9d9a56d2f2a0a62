//! What a recording offers, and frames that are in memory already.

use std::path::PathBuf;

use super::error::SourceError;
use crate::frame::{EyeFrame, StereoFrame};

/// A recording of the left image, and perhaps of the right one.
pub trait FrameSource: std::fmt::Debug {
    /// Number of frames.
    fn len(&self) -> usize;

    /// Whether there is no frame.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Decodes the left image of one frame.
    ///
    /// # Errors
    /// The frame does not exist or is damaged.
    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError>;
}

/// A recording of side-by-side frames.
pub trait StereoSource: FrameSource {
    /// Decodes one frame.
    ///
    /// # Errors
    /// The frame does not exist or is damaged.
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError>;
}

/// Frames that are in memory already.
impl FrameSource for Vec<StereoFrame> {
    fn len(&self) -> usize {
        Vec::len(self)
    }

    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError> {
        self.read(index).map(|frame| frame.left())
    }
}

impl StereoSource for Vec<StereoFrame> {
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

impl FrameSource for Box<dyn StereoSource> {
    fn len(&self) -> usize {
        (**self).len()
    }

    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError> {
        (**self).read_left(index)
    }
}

impl StereoSource for Box<dyn StereoSource> {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        (**self).read(index)
    }
}

/// Decodes the left image of every frame.
///
/// # Errors
/// A frame is damaged.
pub fn read_left(source: &mut dyn FrameSource) -> Result<Vec<EyeFrame>, SourceError> {
    (0..source.len()).map(|i| source.read_left(i)).collect()
}
