//! From films and keypoints to cameras, keypoints and ropes, by the commands.
#![cfg(test)]

#[cfg(feature = "calibration")]
mod board;
mod identify;
mod images;
#[path = "../support/mod.rs"]
mod support;
mod video;
