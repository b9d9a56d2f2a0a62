//! From films and keypoints to cameras, keypoints and ropes, by the commands.
#![cfg(test)]

mod identify;
mod images;
#[cfg(feature = "calibration")]
#[path = "../../../camera-ingest/tests/printed_board/mod.rs"]
mod printed_board;
#[path = "../support/mod.rs"]
mod support;
mod video;
