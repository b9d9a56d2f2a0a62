//! Plans as `wag plan` writes them.

use super::text::read_json;
use crate::{Error, Result};
use shared_types::Plan;
use shared_types::plan::trajectory_hash_hex;
use std::path::Path;

/// Reads a plan and verifies that it is whole.
///
/// # Errors
/// The file cannot be read, is no plan, or was changed after it was planned.
pub fn read_plan(path: &Path) -> Result<Plan> {
    let plan: Plan = read_json(path)?;
    if trajectory_hash_hex(&plan.trajectory) == plan.trajectory_sha256 {
        return Ok(plan);
    }
    Err(Error::Table {
        path: path.to_owned(),
        problem: ": `trajectory_sha256` does not match the waypoints; the file was changed by \
                  hand or damaged, plan again"
            .to_owned(),
    })
}
