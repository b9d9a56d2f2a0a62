//! Formats that a build leaves out, under the names of those who write them: they always refuse,
//! and say how a build that can is made.

use crate::written::Written;
use cli_output::{Failure, Outcome};
use std::path::Path;

/// Would write Foxglove's messages.
///
/// # Errors
/// Always.
#[cfg(not(feature = "foxglove"))]
pub fn foxglove(_run: &Path, _out: Option<&Path>) -> Outcome<Written> {
    let cannot = "write the messages of Foxglove's SDK (Foxglove opens run.mcap as it is, too)";
    Err(Failure::not_built(cannot, "foxglove"))
}

/// Would write a data set.
///
/// # Errors
/// Always.
#[cfg(not(feature = "lerobot"))]
pub fn lerobot(_runs: &[std::path::PathBuf], _out: &Path, _fps: Option<u32>) -> Outcome<Written> {
    Err(Failure::not_built("write data sets for LeRobot", "lerobot"))
}

/// Would write a bag.
///
/// # Errors
/// Always.
#[cfg(not(feature = "ros2"))]
pub fn ros2(_run: &Path, _out: Option<&Path>) -> Outcome<Written> {
    Err(Failure::not_built("write bags of ROS 2", "ros2"))
}
