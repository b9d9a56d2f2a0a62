//! Files of people and runs: reading with errors that name file and field,
//! writing so that nothing is ever half there.

mod arm_response;
mod atomic;
mod motion;
mod plan;
mod rope;

pub use arm_response::{read_arm_response, read_excitation, write_arm_response};
pub use atomic::{check_writable, write_atomic, write_json};
pub use motion::{JointsCsv, PoseSample, read_joints, read_pose, write_joints};
pub use plan::read_plan;
pub use rope::{read_posterior, read_rope, write_rope_estimate};

use crate::{Error, Result};
use std::path::Path;

/// Reads a text file.
///
/// # Errors
/// [`Error::Read`].
pub fn read_text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(Error::read(path))
}
