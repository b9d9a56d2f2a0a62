//! Frames that are decoded one by one from where they are stored.

use std::borrow::Cow;
use std::path::Path;

use super::error::SourceError;
use super::frames::{FrameSource, StereoSource};
use super::stamps::Stamp;
use crate::frame::{EyeFrame, FrameError, StereoFrame};

/// How a side-by-side picture is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    Jpeg,
    Png,
    /// `YUYV` of this size, both images together (px).
    Yuyv([usize; 2]),
}

impl Coding {
    fn stereo(self, bytes: &[u8], stamp: Stamp) -> Result<StereoFrame, FrameError> {
        let (stamp_ns, sequence) = (stamp.stamp_ns, stamp.sequence);
        match self {
            Self::Jpeg => StereoFrame::from_jpeg(bytes, stamp_ns, sequence),
            Self::Png => StereoFrame::from_png(bytes, stamp_ns, sequence),
            Self::Yuyv(size_px) => StereoFrame::from_yuyv(bytes, size_px, stamp_ns, sequence),
        }
    }

    fn left(self, bytes: &[u8], stamp: Stamp, room: &mut Vec<u8>) -> Result<EyeFrame, FrameError> {
        let (stamp_ns, sequence) = (stamp.stamp_ns, stamp.sequence);
        match self {
            Self::Jpeg => EyeFrame::left_from_jpeg(bytes, stamp_ns, sequence, room),
            Self::Png => self.stereo(bytes, stamp).map(|frame| frame.left()),
            Self::Yuyv(size_px) => EyeFrame::left_from_yuyv(bytes, size_px, stamp_ns, sequence),
        }
    }
}

/// A recording whose frames are stored as coded pictures.
pub(super) trait Stored: std::fmt::Debug {
    /// The recording, for messages.
    fn path(&self) -> &Path;

    /// The file that a frame is in, for messages.
    fn file(&self, _index: usize) -> &Path {
        self.path()
    }

    /// When each frame was taken.
    fn stamps(&self) -> &[Stamp];

    /// A frame as it is stored; `index` is one of the recording.
    fn picture(&self, index: usize) -> Result<(Coding, Cow<'_, [u8]>), SourceError>;

    /// Memory that decoding may use again from frame to frame.
    fn room(&mut self) -> Vec<u8> {
        Vec::new()
    }

    /// Takes that memory back.
    fn keep(&mut self, _room: Vec<u8>) {}

    /// Whether a frame may be of this size (both images, px).
    fn check_size(&self, _found: [usize; 2]) -> Result<(), FrameError> {
        Ok(())
    }
}

fn decode<S: Stored, T>(
    source: &S,
    index: usize,
    decode: impl FnOnce(Coding, &[u8], Stamp) -> Result<T, FrameError>,
    size_px: impl FnOnce(&T) -> [usize; 2],
) -> Result<T, SourceError> {
    let Some(stamp) = source.stamps().get(index) else {
        return Err(SourceError::OutOfRange {
            path: source.path().to_owned(),
            frame: index,
            len: source.stamps().len(),
        });
    };
    let (coding, bytes) = source.picture(index)?;
    let frame = decode(coding, &bytes, *stamp)
        .and_then(|frame| source.check_size(size_px(&frame)).map(|()| frame));
    frame.map_err(|error| SourceError::Frame {
        path: source.file(index).to_owned(),
        frame: index,
        source: error,
    })
}

impl<S: Stored> FrameSource for S {
    fn len(&self) -> usize {
        self.stamps().len()
    }

    fn read_left(&mut self, index: usize) -> Result<EyeFrame, SourceError> {
        let mut room = self.room();
        let left = |coding: Coding, bytes: &[u8], stamp| coding.left(bytes, stamp, &mut room);
        let frame = decode(self, index, left, |f| [2 * f.width_px, f.height_px]);
        self.keep(room);
        frame
    }
}

impl<S: Stored> StereoSource for S {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        decode(self, index, Coding::stereo, |f| {
            [f.0.width_px, f.0.height_px]
        })
    }
}
