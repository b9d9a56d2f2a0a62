//! What is refused, and why.

use shared_types::StereoCamera;
use shared_types::keypoints::MAX_KEYPOINTS;

use super::TrackOptions;
use super::first_frame::NotFound;
use super::models::ModelError;
use crate::frame::EyeFrame;

/// Why a recording cannot be tracked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Too few frames, or too many or few keypoints.
    #[error("tracking: {what} is {found}, it must be {}", allowed(*least, *most))]
    Range {
        /// `frames` or an option's name.
        what: &'static str,
        /// Number given.
        found: usize,
        /// Least allowed.
        least: usize,
        /// Most allowed.
        most: usize,
    },
    /// Frames differ from the camera's size.
    #[error(
        "tracking: frame {frame} is {found:?} px, the camera's mode gives {expected:?} px per image; \
         is the `mode` in camera.toml the one recorded?"
    )]
    Size {
        /// Index of the frame.
        frame: usize,
        /// Its size.
        found: [usize; 2],
        /// The camera's.
        expected: [usize; 2],
    },
    /// Times of the frames do not increase.
    #[error("tracking: the time stamp of frame {frame} is not later than the one before")]
    Times {
        /// Index of the frame.
        frame: usize,
    },
    /// The clamp cannot be seen.
    #[error(
        "tracking: in the first frame (frame 0) the clamp should be at pixel ({u:.0}, {v:.0}), outside the \
         image; check the camera's extrinsics and the clamp's path"
    )]
    ClampOutside {
        /// Pixel column.
        u: f64,
        /// Pixel row.
        v: f64,
    },
    /// No rope in the first frame.
    #[error(
        "tracking: nothing long enough hangs on the clamp in the first frame (frame 0; longest {longest_m:.3} \
         m); the rope must hang still at first, move later, and differ from what is behind it"
    )]
    NoRope {
        /// Longest moving thing that hangs on the clamp (m).
        longest_m: f64,
    },
    /// The rope cannot be followed.
    #[error(
        "tracking: the rope is lost in {lost} of {frames} frames, first in frame {first}; does it \
         leave the image, or does something cover it?"
    )]
    MostlyLost {
        /// Frames in which it is lost.
        lost: usize,
        /// All frames.
        frames: usize,
        /// First frame in which it is lost, from 0.
        first: usize,
    },
    /// A learned model failed.
    #[error("tracking: {0}")]
    Model(#[from] ModelError),
}

impl TrackError {
    /// Whether film, camera and motion cannot be tracked as given; else the rope was looked
    /// for and not found.
    #[must_use]
    pub fn is_input(&self) -> bool {
        !matches!(self, Self::NoRope { .. } | Self::MostlyLost { .. })
    }
}

impl From<NotFound> for TrackError {
    fn from(reason: NotFound) -> Self {
        match reason {
            NotFound::ClampOutside([u, v]) => Self::ClampOutside { u, v },
            NotFound::NothingHangs(longest_m) => Self::NoRope { longest_m },
            NotFound::NoMask(error) => Self::Model(error),
        }
    }
}

fn allowed(least: usize, most: usize) -> String {
    if most == usize::MAX {
        return format!("at least {least}");
    }
    format!("{least} to {most}")
}

pub(super) fn check(
    frames: &[EyeFrame],
    camera: &StereoCamera,
    options: &TrackOptions,
) -> Result<(), TrackError> {
    range("frames", frames.len(), 8, usize::MAX)?;
    check_keypoints(options.keypoints)?;
    range("background_frames", options.background_frames, 3, 255)?;
    for (index, frame) in frames.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| &frames[before]);
        check_frame(index, before, frame, camera)?;
    }
    Ok(())
}

fn range(what: &'static str, found: usize, least: usize, most: usize) -> Result<(), TrackError> {
    if (least..=most).contains(&found) {
        return Ok(());
    }
    Err(TrackError::Range {
        what,
        found,
        least,
        most,
    })
}

pub(super) fn check_keypoints(count: usize) -> Result<(), TrackError> {
    range("keypoints", count, 2, MAX_KEYPOINTS)
}

/// The `index`-th frame has the camera's size and is later than the one before.
pub(super) fn check_frame(
    index: usize,
    before: Option<&EyeFrame>,
    frame: &EyeFrame,
    camera: &StereoCamera,
) -> Result<(), TrackError> {
    let expected = [camera.width_px as usize, camera.height_px as usize];
    let found = [frame.width_px, frame.height_px];
    if found != expected {
        return Err(TrackError::Size {
            frame: index,
            found,
            expected,
        });
    }
    if before.is_some_and(|before| frame.stamp_ns <= before.stamp_ns) {
        return Err(TrackError::Times { frame: index });
    }
    Ok(())
}
