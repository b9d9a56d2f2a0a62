//! Files of people and runs, as this program reads them.

mod limits;

pub use limits::{default_limits, read_limits};
pub use run_log::files::*;

use rope_sim::PoseRow;
use std::path::Path;

/// Reads `t,x,y,z,qw,qx,qy,qz` (s, m, unit quaternion of the attach frame).
pub fn read_pose(path: &Path) -> anyhow::Result<Vec<PoseRow>> {
    let samples = run_log::files::read_pose(path)?;
    let row = |s: PoseSample| PoseRow {
        t_s: s.t_s,
        p_m: s.p_m,
        q_wxyz: s.q_wxyz,
    };
    Ok(samples.into_iter().map(row).collect())
}
