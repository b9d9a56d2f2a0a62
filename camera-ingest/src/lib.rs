//! From camera frames to rope keypoints and to the score of a throw.
//!
//! Takes frames from a camera ([`live`]), reads recordings ([`source`]) and calibrations
//! ([`calib`]), tracks the rope in the left image ([`mod@track`]), measures tip and target
//! in stereo ([`mod@score`]), lets a learned tracker read the film (feature `learned`),
//! draws the result ([`overlay`], [`film`]), tracks the rope online ([`preview`]) and
//! detects when it hangs still ([`still`]).
//!
//! It is *not* the place for rope physics, identification or planning: it handles pixels,
//! cameras and colours only.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

pub mod calib;
pub mod film;
pub mod frame;
#[cfg(feature = "learned")]
pub mod learned;
pub mod live;
pub mod overlay;
pub mod preview;
pub mod process;
mod raw_film;
pub mod score;
pub mod source;
pub mod still;
pub mod track;
mod vectors;
mod whole_file;

pub use calib::{CalibError, load_camera};
pub use frame::{ImageFrame, StereoFrame};
pub use score::{Score, ScoreError, look, score};
pub use source::{FrameSource, SourceError, StereoSource, open_video};
pub use track::{Film, RopeAppearance, TrackError, TrackResult, USUAL_KEYPOINTS, track};
