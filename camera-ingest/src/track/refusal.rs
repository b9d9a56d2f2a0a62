//! What is refused, and why.

use rope_sim::AttachMotion;
use shared_types::StereoCamera;
use shared_types::keypoints::MAX_KEYPOINTS;

use super::TrackOptions;
use super::models::ModelError;
use crate::frame::EyeFrame;

/// The clamp may be this far outside the image: the search turns the camera so far (px).
const BESIDE_PX: f64 = 20.0;

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
         image; check the camera's place in camera.toml, and joints or poses"
    )]
    ClampOutside {
        /// Pixel column.
        u: f64,
        /// Pixel row.
        v: f64,
    },
    /// No rope is explanation enough.
    #[error(
        "tracking: no rope hanging on the clamp explains what is seen: the best one is evident in \
         {:.0} % of its length in the usual frame (it must be {:.0} %), in {:.0} % of the frames \
         where it is seen least ({:.0} %), and by {:.0} % in the worst frames ({:.0} %); check \
         the camera's place in camera.toml, that joints or poses and film are of the same \
         motion, and that the rope is in view all the time and differs from what is behind it",
        100.0 * evident[0], 100.0 * least[0], 100.0 * evident[1], 100.0 * least[1],
        100.0 * evident[2], 100.0 * least[2]
    )]
    NoRope {
        /// How evident the best rope is, 0 to 1: in the middle over the frames, at its
        /// least evident places, in its least evident frames.
        evident: [f64; 3],
        /// How evident it must be in each respect.
        least: [f64; 3],
    },
    /// A part of the rope would be behind the camera.
    #[error(
        "tracking: the rope found would swing behind the camera; check the camera's place in \
         camera.toml and the motion"
    )]
    BehindCamera,
    /// The motion cannot be simulated.
    #[error(
        "tracking: no rope can be simulated under this motion: {reason}; check the joints or poses"
    )]
    Motion {
        /// What the simulation says.
        reason: String,
    },
    /// A learned tracker does not see the rope.
    #[error(
        "tracking: the learned tracker sees less than a quarter of the rope in {lost} of {frames} \
         frames, first in frame {first}; track without it, or with another one"
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

fn allowed(least: usize, most: usize) -> String {
    if most == usize::MAX {
        return format!("at least {least}");
    }
    format!("{least} to {most}")
}

pub(super) fn check(
    frames: &[EyeFrame],
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    options: &TrackOptions,
) -> Result<(), TrackError> {
    range("frames", frames.len(), 8, usize::MAX)?;
    check_keypoints(options.keypoints)?;
    range("background_frames", options.background_frames, 3, 255)?;
    for (index, frame) in frames.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| &frames[before]);
        check_frame(index, before, frame, camera)?;
    }
    check_clamp(camera, motion)
}

/// The clamp is in the first frame, or so little beside it that the camera need only turn
/// a little.
fn check_clamp(camera: &StereoCamera, motion: &dyn AttachMotion) -> Result<(), TrackError> {
    let [u, v] = camera
        .project_left(&motion.at(0.0).p_m)
        .unwrap_or([f64::NAN; 2]);
    let near = |x: f64, size: u32| (-BESIDE_PX..=f64::from(size - 1) + BESIDE_PX).contains(&x);
    if near(u, camera.width_px) && near(v, camera.height_px) {
        return Ok(());
    }
    Err(TrackError::ClampOutside { u, v })
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

pub(crate) fn check_keypoints(count: usize) -> Result<(), TrackError> {
    range("keypoints", count, 2, MAX_KEYPOINTS)
}

/// The `index`-th frame has the camera's size and is later than the one before.
fn check_frame(
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
