//! What a recording offers, and frames that are in memory already.

use std::path::Path;

use super::error::SourceError;
use crate::frame::{ImageFrame, StereoFrame};
use crate::track::Film;

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
    fn read_left(&mut self, index: usize) -> Result<ImageFrame, SourceError>;
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

    fn read_left(&mut self, index: usize) -> Result<ImageFrame, SourceError> {
        self.read(index).map(|frame| frame.left())
    }
}

impl StereoSource for Vec<StereoFrame> {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        self.get(index)
            .cloned()
            .ok_or_else(|| SourceError::out_of_range(Path::new("(memory)"), index, Vec::len(self)))
    }
}

impl FrameSource for Box<dyn StereoSource> {
    fn len(&self) -> usize {
        (**self).len()
    }

    fn read_left(&mut self, index: usize) -> Result<ImageFrame, SourceError> {
        (**self).read_left(index)
    }
}

impl StereoSource for Box<dyn StereoSource> {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        (**self).read(index)
    }
}

/// Frames of the left image, and of the right one those that [`Film::needs_right`].
#[derive(Debug, Clone, Default)]
pub struct BothImages {
    /// Left image, all frames.
    pub left: Vec<ImageFrame>,
    /// Right image; none where the recording has none.
    pub right: Vec<ImageFrame>,
}

impl BothImages {
    /// Adds the next of a film's `count` frames.
    pub(crate) fn add(&mut self, frame: &StereoFrame, count: usize) {
        if Film::needs_right(self.left.len(), count) {
            self.right.push(frame.right());
        }
        self.left.push(frame.left());
    }

    /// For the tracker.
    #[must_use]
    pub fn film(&self) -> Film<'_> {
        Film {
            left: &self.left,
            right: &self.right,
        }
    }
}

/// A recording of both images, or of the left one.
#[derive(Debug)]
pub enum AnySource {
    /// Both.
    Both(Box<dyn StereoSource>),
    /// The left one.
    Left(Box<dyn FrameSource>),
}

impl AnySource {
    /// Decodes what a tracker looks at.
    ///
    /// # Errors
    /// A frame is damaged.
    pub fn read(&mut self) -> Result<BothImages, SourceError> {
        match self {
            Self::Both(source) => read_film(&mut **source),
            Self::Left(source) => Ok(BothImages {
                left: (0..source.len())
                    .map(|index| source.read_left(index))
                    .collect::<Result<_, _>>()?,
                right: Vec::new(),
            }),
        }
    }
}

/// Decodes what a tracker looks at of both images.
///
/// # Errors
/// A frame is damaged.
pub fn read_film(source: &mut dyn StereoSource) -> Result<BothImages, SourceError> {
    let count = source.len();
    let (mut left, mut right) = (Vec::with_capacity(count), Vec::new());
    for index in 0..count {
        if Film::needs_right(index, count) {
            let frame = source.read(index)?;
            left.push(frame.left());
            right.push(frame.right());
        } else {
            left.push(source.read_left(index)?);
        }
    }
    Ok(BothImages { left, right })
}
