//! Plans as `wag plan` writes them.

use super::read_text;
use anyhow::{Context, ensure};
use shared_types::Plan;
use shared_types::plan::trajectory_hash_hex;
use std::path::Path;

/// Reads a plan and verifies that it is whole.
pub fn read_plan(path: &Path) -> anyhow::Result<Plan> {
    let fail = || format!("plan `{}`", path.display());
    let plan: Plan = serde_json::from_str(&read_text(path)?).with_context(fail)?;
    ensure!(
        trajectory_hash_hex(&plan.trajectory) == plan.trajectory_sha256,
        "plan `{}`: `trajectory_sha256` does not match the waypoints; the file was changed by hand or damaged, plan again",
        path.display()
    );
    Ok(plan)
}
