//! The simulated rig: arm, hidden rope and stereo camera in real time.

pub mod body;
mod camera;

pub use camera::{CameraConfig, Resolution};
