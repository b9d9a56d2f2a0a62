//! Raw V4L2 `YUYV` frames one after the other, without any header.

use std::path::{Path, PathBuf};

use super::{FrameSource, SourceError, read_bytes};
use crate::frame::StereoFrame;

/// A raw file held in memory.
#[derive(Debug)]
pub struct YuyvSource {
    path: PathBuf,
    bytes: Vec<u8>,
    size_px: [usize; 2],
    frame_ns: u64,
}

impl YuyvSource {
    /// Opens a raw file of frames of `size_px` (`[width of both eyes, height]`)
    /// taken every `frame_ns`.
    ///
    /// # Errors
    /// No such file, or its length is no multiple of a frame.
    pub fn open(path: &Path, size_px: [usize; 2], frame_ns: u64) -> Result<Self, SourceError> {
        let bytes = read_bytes(path)?;
        let frame = size_px[0] * size_px[1] * 2;
        if frame == 0 || bytes.is_empty() || !bytes.len().is_multiple_of(frame) {
            return Err(SourceError::Container {
                path: path.to_owned(),
                reason: format!(
                    "{} bytes are no whole number of {}x{} YUYV frames ({frame} bytes each)",
                    bytes.len(),
                    size_px[0],
                    size_px[1]
                ),
                remedy: "give the size of both eyes together, or copy the file again",
            });
        }
        Ok(Self {
            path: path.to_owned(),
            bytes,
            size_px,
            frame_ns,
        })
    }
}

impl FrameSource for YuyvSource {
    fn len(&self) -> usize {
        self.bytes.len() / (self.size_px[0] * self.size_px[1] * 2)
    }

    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        let frame = self.size_px[0] * self.size_px[1] * 2;
        let body = self
            .bytes
            .get(index * frame..(index + 1) * frame)
            .ok_or_else(|| SourceError::OutOfRange {
                path: self.path.clone(),
                frame: index,
                len: self.bytes.len() / frame,
            })?;
        let sequence = index as u64;
        StereoFrame::from_yuyv(body, self.size_px, sequence * self.frame_ns, sequence).map_err(
            |source| SourceError::Frame {
                path: self.path.clone(),
                frame: index,
                source,
            },
        )
    }
}
