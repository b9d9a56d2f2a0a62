//! Frames kept in memory for tracking or scoring.

use crate::frame::{ImageFrame, StereoFrame};
use crate::source::{BothImages, FrameSource, SourceError, StereoSource};
use crate::track::Film;
use shared_types::ipc::message::CameraEvent;
use std::path::Path;

/// Most frames one recording may keep.
const MAX_FRAMES: u32 = 3600;

#[derive(Debug)]
enum Frames {
    /// What the tracker looks at: the right image of some frames only.
    Film(BothImages),
    Both(Vec<StereoFrame>),
}

/// A recording in memory.
#[derive(Debug)]
pub(super) struct Recording {
    wanted: u32,
    frames: Frames,
    first_sequence: u64,
    last_sequence: u64,
    first_stamp_ns: u64,
    last_stamp_ns: u64,
}

impl Default for Recording {
    fn default() -> Self {
        Self::begin(0, false)
    }
}

impl Recording {
    pub(super) fn begin(frames: u32, both_images: bool) -> Self {
        Self {
            wanted: frames.min(MAX_FRAMES),
            frames: if both_images {
                Frames::Both(Vec::new())
            } else {
                Frames::Film(BothImages::default())
            },
            first_sequence: 0,
            last_sequence: 0,
            first_stamp_ns: 0,
            last_stamp_ns: 0,
        }
    }

    pub(super) fn wanted(&self) -> u32 {
        self.wanted
    }

    fn count(&self) -> usize {
        match &self.frames {
            Frames::Film(film) => film.left.len(),
            Frames::Both(v) => v.len(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count() == 0
    }

    /// Frames the camera counted but that never arrived here.
    pub(super) fn dropped(&self) -> u32 {
        let span = self.last_sequence.saturating_sub(self.first_sequence) + 1;
        u32::try_from(span.saturating_sub(self.count() as u64)).unwrap_or(u32::MAX)
    }

    fn rate_hz(&self) -> f64 {
        let taken = self.last_sequence.saturating_sub(self.first_sequence);
        let over_ns = self.last_stamp_ns.saturating_sub(self.first_stamp_ns);
        1e9 * taken as f64 / over_ns.max(1) as f64
    }

    pub(super) fn first_stamp_ns(&self) -> u64 {
        self.first_stamp_ns
    }

    /// Keeps one frame; returns how many there are.
    pub(super) fn keep(&mut self, frame: StereoFrame) -> u32 {
        if self.is_empty() {
            self.first_sequence = frame.0.sequence;
            self.first_stamp_ns = frame.0.stamp_ns;
        }
        self.last_sequence = frame.0.sequence;
        self.last_stamp_ns = frame.0.stamp_ns;
        match &mut self.frames {
            Frames::Film(film) => film.add(&frame, self.wanted as usize),
            Frames::Both(v) => v.push(frame),
        }
        u32::try_from(self.count()).unwrap_or(u32::MAX)
    }

    pub(super) fn finished(&self) -> Option<CameraEvent> {
        let frames = u32::try_from(self.count()).unwrap_or(u32::MAX);
        (frames >= self.wanted).then(|| CameraEvent::Recorded {
            first_stamp_ns: self.first_stamp_ns,
            frames,
            dropped: self.dropped(),
            rate_hz: self.rate_hz(),
        })
    }

    /// The frames for the tracker. Right images that it does not look at are let go.
    pub(super) fn film(&mut self) -> Option<Film<'_>> {
        if let Frames::Both(both) = &mut self.frames {
            let mut film = BothImages::default();
            for frame in std::mem::take(both) {
                film.add(&frame, self.wanted as usize);
            }
            self.frames = Frames::Film(film);
        }
        match &self.frames {
            Frames::Film(film) if !film.left.is_empty() => Some(film.film()),
            Frames::Film(_) | Frames::Both(_) => None,
        }
    }

    /// Whether both images were kept.
    pub(super) fn has_both(&self) -> bool {
        matches!(&self.frames, Frames::Both(v) if !v.is_empty())
    }
}

/// A recording of both images is a source like any file.
impl FrameSource for Recording {
    fn len(&self) -> usize {
        self.count()
    }

    fn read_left(&mut self, index: usize) -> Result<ImageFrame, SourceError> {
        self.read(index).map(|frame| frame.left())
    }
}

impl StereoSource for Recording {
    fn read(&mut self, index: usize) -> Result<StereoFrame, SourceError> {
        let frame = match &self.frames {
            Frames::Both(v) => v.get(index),
            Frames::Film(_) => None,
        };
        let path = Path::new("recording in memory");
        frame
            .cloned()
            .ok_or_else(|| SourceError::out_of_range(path, index, self.count()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(sequence: u64) -> StereoFrame {
        let bytes = vec![128u8; 8 * 4 * 2];
        StereoFrame::from_yuyv(&bytes, [8, 4], 1000 + sequence, sequence).unwrap()
    }

    #[test]
    fn counts_kept_and_dropped_frames() {
        let mut r = Recording::begin(3, false);
        assert!(r.finished().is_none() && r.film().is_none());
        r.keep(frame(10));
        r.keep(frame(11));
        assert_eq!(r.keep(frame(14)), 3);
        assert_eq!(
            r.finished(),
            Some(CameraEvent::Recorded {
                first_stamp_ns: 1010,
                frames: 3,
                dropped: 2,
                // The frames of this test are a nanosecond apart.
                rate_hz: 1e9,
            })
        );
        assert_eq!(
            r.film().map(|f| (f.left.len(), f.right.len())),
            Some((3, 3))
        );
        assert!(
            r.read(0).is_err(),
            "right images were kept for the tracker only"
        );
    }

    #[test]
    fn both_eyes_can_be_read_back() {
        let mut r = Recording::begin(2, true);
        r.keep(frame(1));
        r.keep(frame(2));
        assert!(r.has_both());
        assert_eq!(r.read(1).unwrap(), frame(2));
        assert!(r.read(2).is_err());
        let film = r.film().map(|f| (f.left.to_vec(), f.right.len()));
        assert_eq!(film, Some((vec![frame(1).left(), frame(2).left()], 2)));
        assert!(!r.has_both(), "the tracker has them now");
    }
}
