//! Recordings whose frames are decoded one by one from where they are stored.

use std::borrow::Cow;
use std::fs::File;
use std::ops::Range;
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use super::error::SourceError;
use super::frames::{FrameSource, StereoSource};
use super::stamps::Stamp;
use crate::frame::{FrameError, ImageFrame, StereoFrame};

/// How a side-by-side picture is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coding {
    Jpeg,
    Png,
    /// `YUYV` of this size, both images together (px).
    Yuyv([usize; 2]),
}

impl Coding {
    /// The coding of a picture by its file's ending.
    pub(super) fn of_file(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        match ending.as_str() {
            "png" => Some(Self::Png),
            "jpg" | "jpeg" => Some(Self::Jpeg),
            _ => None,
        }
    }

    fn stereo(self, bytes: &[u8], stamp: Stamp) -> Result<StereoFrame, FrameError> {
        let (stamp_ns, sequence) = (stamp.stamp_ns, stamp.sequence);
        match self {
            Self::Jpeg => StereoFrame::from_jpeg(bytes, stamp_ns, sequence),
            Self::Png => StereoFrame::from_png(bytes, stamp_ns, sequence),
            Self::Yuyv(size_px) => StereoFrame::from_yuyv(bytes, size_px, stamp_ns, sequence),
        }
    }

    fn left(
        self,
        bytes: &[u8],
        stamp: Stamp,
        room: &mut Vec<u8>,
    ) -> Result<ImageFrame, FrameError> {
        let (stamp_ns, sequence) = (stamp.stamp_ns, stamp.sequence);
        match self {
            Self::Jpeg => ImageFrame::left_from_jpeg(bytes, stamp_ns, sequence, room),
            Self::Png => self.stereo(bytes, stamp).map(|frame| frame.left()),
            Self::Yuyv(size_px) => ImageFrame::left_from_yuyv(bytes, size_px, stamp_ns, sequence),
        }
    }
}

/// Where the pictures of a recording are.
#[derive(Debug)]
pub(super) enum Pictures {
    /// JPEGs within the bytes of an AVI file, in memory.
    Avi(Vec<u8>, Vec<Range<usize>>),
    /// A file each.
    Files(Vec<PathBuf>),
    /// `YUYV` of this size (both images, px) one after the other: a minute of it does not
    /// fit into memory.
    Yuyv(File, [usize; 2]),
}

/// A recording in a file or a folder.
#[derive(Debug)]
pub(super) struct Stored {
    path: PathBuf,
    pictures: Pictures,
    /// When each frame was taken.
    pub(super) stamps: Vec<Stamp>,
    /// What every frame must measure, if anything: both images together (px).
    pub(super) size_px: Option<[usize; 2]>,
    /// For decoding, used again from frame to frame.
    room: Vec<u8>,
}

impl Stored {
    pub(super) fn new(path: &Path, pictures: Pictures, stamps: Vec<Stamp>) -> Self {
        Self {
            path: path.to_owned(),
            pictures,
            stamps,
            size_px: None,
            room: Vec::new(),
        }
    }

    /// A frame as it is stored; `index` is one of the recording.
    pub(super) fn picture(&self, index: usize) -> Result<(Coding, Cow<'_, [u8]>), SourceError> {
        Ok(match &self.pictures {
            Pictures::Avi(bytes, chunks) => {
                (Coding::Jpeg, Cow::Borrowed(&bytes[chunks[index].clone()]))
            }
            Pictures::Files(files) => {
                let path = &files[index];
                let bytes = std::fs::read(path).map_err(SourceError::io(path))?;
                let coding = Coding::of_file(path).unwrap_or(Coding::Jpeg);
                (coding, Cow::Owned(bytes))
            }
            Pictures::Yuyv(file, size_px) => {
                let mut bytes = vec![0; size_px[0] * size_px[1] * 2];
                let at = index as u64 * bytes.len() as u64;
                let read = file.read_exact_at(&mut bytes, at);
                read.map_err(SourceError::io(&self.path))?;
                (Coding::Yuyv(*size_px), Cow::Owned(bytes))
            }
        })
    }

    fn decode<T>(
        &self,
        index: usize,
        decode: impl FnOnce(Coding, &[u8], Stamp) -> Result<T, FrameError>,
        size_px: impl FnOnce(&T) -> [usize; 2],
    ) -> Result<T, SourceError> {
        let Some(stamp) = self.stamps.get(index) else {
            return Err(SourceError::out_of_range(&self.path, index, self.len()));
        };
        let (coding, bytes) = self.picture(index)?;
        let frame = decode(coding, &bytes, *stamp).and_then(|frame| {
            let found = size_px(&frame);
            match self.size_px {
                Some(expected) if found != expected => Err(FrameError::size(found, expected)),
                _ => Ok(frame),
            }
        });
        let file = match &self.pictures {
            Pictures::Files(files) => &files[index],
            Pictures::Avi(..) | Pictures::Yuyv(..) => &self.path,
        };
        frame.map_err(|error| SourceError::frame(file, index, &error))
    }
}

impl FrameSource for Stored {
    fn len(&self) -> usize {
        self.stamps.len()
    }

    fn read_left(&mut self, index: usize) -> Result<ImageFrame, SourceError> {
        let mut room = std::mem::take(&mut self.room);
        let left = |coding: Coding, bytes: &[u8], stamp| coding.left(bytes, stamp, &mut room);
        let frame = self.decode(index, left, |f| [2 * f.width_px, f.height_px]);
        self.room = room;
        frame
    }
}

impl StereoSource for Stored {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        self.decode(index, Coding::stereo, |f| [f.0.width_px, f.0.height_px])
    }
}
