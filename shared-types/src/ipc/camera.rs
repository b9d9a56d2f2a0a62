//! What is asked of the camera process, and its answers.

use super::message::Progress;
use super::rpc::Rpc;
use super::sight::{DominoLook, RopeAppearance, ScoreResult, SeenThrow};
use crate::camera::StereoCamera;
use arm_model::cell::Pole;
use arm_model::joint::JointVector;
use serde::{Deserialize, Serialize};

/// Asks of the camera process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum CameraRequest {
    /// Are you there?
    Ping,
    /// Wait until nothing moves in the picture, at most `timeout_s`.
    WaitStill {
        /// Longest wait (s).
        timeout_s: f64,
    },
    /// Keep the next `frames` frames, replacing those kept before. Answers
    /// `Recording` when the first one is kept and `Recorded` at the end.
    Record {
        /// Number of frames.
        frames: u32,
        /// Keep every right image too, for scoring or a film; tracking needs the left ones and a
        /// few of the right.
        both_images: bool,
    },
    /// Write the kept frames, of which both images must be there, as a raw film.
    Keep {
        /// Prefix of its name: `NAME_WIDTHxHEIGHT.yuyv`, and its times in a CSV beside it.
        name: String,
    },
    /// Track the rope through the kept frames and publish its keypoints.
    Track {
        /// Calibrated camera.
        camera: Box<StereoCamera>,
        /// Measured joints: CLOCK_MONOTONIC ns and position (rad).
        joints: Vec<(u64, JointVector)>,
        /// The pole that carries the clamp.
        pole: Pole,
        /// Keypoints per frame.
        keypoints: u32,
        /// Where to write a contact sheet of overlays (PNG), if anywhere.
        overlay: Option<String>,
    },
    /// Tell where the tip is in the kept frames of a throw after which it comes to rest.
    Look {
        /// Calibrated camera.
        camera: Box<StereoCamera>,
        /// Colour of the tip.
        tip_rgb: [u8; 3],
        /// The domino to look for, if any.
        domino: Option<DominoLook>,
        /// When the throw began, and until when it is looked at (CLOCK_MONOTONIC, ns).
        span_ns: [u64; 2],
        /// Where to write a multiple-exposure picture of the throw (PNG), if anywhere.
        strobe: Option<String>,
    },
    /// Measure the closest approach of tip and target in the kept frames.
    Score {
        /// Calibrated camera.
        camera: Box<StereoCamera>,
        /// Colour of the tip.
        tip_rgb: [u8; 3],
        /// Colour of the target.
        target_rgb: [u8; 3],
        /// Where to write a multiple-exposure picture of the throw (PNG), if anywhere.
        strobe: Option<String>,
    },
}

/// Answers of the camera process.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum CameraEvent {
    /// Here I am.
    Pong,
    /// The picture is still, or the wait ran out (`still` false).
    Still {
        /// Whether it is still.
        still: bool,
        /// Width and height of one image (px).
        size_px: [u32; 2],
    },
    /// The first frame is kept.
    Recording {
        /// Its start of exposure (CLOCK_MONOTONIC, ns).
        first_stamp_ns: u64,
    },
    /// Work goes on.
    Progress(Progress),
    /// The frames are written.
    Kept,
    /// All frames are kept.
    Recorded {
        /// Start of exposure of the first (CLOCK_MONOTONIC, ns).
        first_stamp_ns: u64,
        /// Frames kept.
        frames: u32,
        /// Frames the camera dropped in between.
        dropped: u32,
        /// Frames a second that it took, dropped ones among them; 0 where its numbers began anew.
        rate_hz: f64,
    },
    /// Keypoints of all frames are published.
    Tracked {
        /// Start of exposure of the first frame (CLOCK_MONOTONIC, ns).
        first_stamp_ns: u64,
        /// Frames published.
        frames: u32,
        /// Part of the frames in which the rope was lost (0 to 1).
        lost_fraction: f64,
        /// Sizes and colours.
        appearance: RopeAppearance,
        /// Processing time per frame (ms).
        ms_per_frame: f64,
        /// Why the track should not be relied on; none where it may be.
        unconfirmed: Vec<String>,
    },
    /// The throw is measured.
    Scored(ScoreResult),
    /// What was looked for was found, as far as it was in view.
    Seen(SeenThrow),
    /// It did not work.
    Failed {
        /// One sentence: what happened and what to do.
        message: String,
    },
}

/// The camera process's service.
#[derive(Debug)]
pub struct CameraRpc;

impl Rpc for CameraRpc {
    const NAME: &'static str = "wag/v2/camera/control";
    type Request = CameraRequest;
    type Event = CameraEvent;
    fn is_last(event: &CameraEvent) -> bool {
        !matches!(
            event,
            CameraEvent::Progress(_) | CameraEvent::Recording { .. }
        )
    }
}
