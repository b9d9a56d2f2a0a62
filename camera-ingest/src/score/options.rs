//! What a caller may choose, and why a throw cannot be scored.

use crate::source::SourceError;

/// What a caller may choose.
#[derive(Debug, Clone, PartialEq)]
pub struct ScoreOptions {
    /// Frames for the median background.
    pub background_frames: usize,
    /// Largest distance of the two images' rays, in pixels of the image.
    pub epipolar_px: f64,
    /// Largest ratio of the blob's areas in the two images.
    pub area_ratio: f64,
    /// Nearest and farthest depth looked at (m).
    pub depth_m: [f64; 2],
}

impl Default for ScoreOptions {
    fn default() -> Self {
        Self {
            background_frames: 31,
            epipolar_px: 1.5,
            area_ratio: 1.33,
            depth_m: [0.25, 5.0],
        }
    }
}

/// Why a throw cannot be scored.
#[derive(Debug, thiserror::Error)]
pub enum ScoreError {
    /// A frame cannot be read.
    #[error(transparent)]
    Source(#[from] SourceError),
    /// Too few frames.
    #[error("score: the video has {found} frames, at least {least} are needed")]
    TooShort {
        /// Frames found.
        found: usize,
        /// Frames needed.
        least: usize,
    },
    /// Frames differ from the camera's size.
    #[error(
        "score: frame {frame} is {found:?} px per image, the camera's mode gives {expected:?}; is the \
         `mode` in camera.toml the one recorded?"
    )]
    Size {
        /// Index of the frame.
        frame: usize,
        /// Its size.
        found: [usize; 2],
        /// The camera's.
        expected: [usize; 2],
    },
    /// A colour too grey to be found by chroma.
    #[error(
        "score: the {what}'s colour {rgb:?} is nearly grey; give the colour of a saturated marker"
    )]
    Grey {
        /// `tip` or `target`.
        what: &'static str,
        /// Colour given.
        rgb: [u8; 3],
    },
    /// Not found in enough frames.
    #[error(
        "score: the {what} was detected in both images of {seen} frames, at least {least} are needed; \
         check its colour and the light"
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
