//! What is refused, and why.

use std::fmt::Display;

use rope_sim::AttachMotion;
use shared_types::StereoCamera;
use shared_types::keypoints::MAX_KEYPOINTS;

use super::ModelError;
use crate::frame::ImageFrame;

/// Fewer frames show no motion.
const MIN_FRAMES: usize = 8;
/// The clamp may be this far outside the image: the search turns the camera so far (px).
const BESIDE_PX: f64 = 20.0;

/// Why a recording cannot be tracked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TrackError {
    /// Film, camera or motion are not such that a rope could be looked for.
    #[error("tracking: {0}")]
    Input(String),
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

    /// The motion cannot be simulated.
    pub(super) fn motion(reason: impl Display) -> Self {
        Self::Input(format!(
            "no rope can be simulated under this motion: {reason}; check the joints or poses"
        ))
    }

    /// A part of the rope would be behind the camera.
    pub(super) fn behind_camera() -> Self {
        Self::Input(
            "the rope found would swing behind the camera; check the camera's place in \
             camera.toml and the motion"
                .to_owned(),
        )
    }
}

fn unless(fine: bool, problem: impl FnOnce() -> String) -> Result<(), TrackError> {
    if fine {
        return Ok(());
    }
    Err(TrackError::Input(problem()))
}

pub(super) fn check(
    frames: &[ImageFrame],
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    keypoints: usize,
) -> Result<(), TrackError> {
    let count = frames.len();
    unless(count >= MIN_FRAMES, || {
        format!("frames is {count}, it must be at least {MIN_FRAMES}")
    })?;
    check_keypoints(keypoints)?;
    let expected = [camera.width_px as usize, camera.height_px as usize];
    for (index, frame) in frames.iter().enumerate() {
        let found = [frame.width_px, frame.height_px];
        unless(found == expected, || {
            format!(
                "frame {index} is {found:?} px, the camera's mode gives {expected:?} px per \
                 image; is the `mode` in camera.toml the one recorded?"
            )
        })?;
        let is_later = index == 0 || frame.stamp_ns > frames[index - 1].stamp_ns;
        unless(is_later, || {
            format!("the time stamp of frame {index} is not later than the one before")
        })?;
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
    unless(
        near(u, camera.width_px) && near(v, camera.height_px),
        || {
            format!(
                "in the first frame (frame 0) the clamp should be at pixel ({u:.0}, {v:.0}), outside \
             the image; check the camera's place in camera.toml, and joints or poses"
            )
        },
    )
}

pub(crate) fn check_keypoints(count: usize) -> Result<(), TrackError> {
    unless((2..=MAX_KEYPOINTS).contains(&count), || {
        format!("keypoints is {count}, it must be 2 to {MAX_KEYPOINTS}")
    })
}
