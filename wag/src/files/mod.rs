//! Files of people and runs: reading with errors that name file and field,
//! writing so that nothing is ever half there.

mod arm_response;
mod atomic;
mod limits;
mod motion;
mod rope;

pub use arm_response::{read_arm_response, read_excitation, write_arm_response};
pub use atomic::{check_writable, write_atomic, write_json};
pub use limits::{default_limits, read_limits};
pub use motion::{JointsCsv, read_joints, read_pose, write_joints};
pub use rope::{read_posterior, read_rope, write_rope_estimate};

use anyhow::Context;
use std::path::Path;

/// Reads a text file; the error names it and says what to do.
pub fn read_text(path: &Path) -> anyhow::Result<String> {
    std::fs::read_to_string(path).with_context(|| {
        format!(
            "cannot read `{}`; check the path and its permissions",
            path.display()
        )
    })
}
