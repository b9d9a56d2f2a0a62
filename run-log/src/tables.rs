//! The control cycles and the measured joints of a run as CSV tables.

use crate::mcap_file::mode_name;
use crate::run::Cycles;
use crate::{Result, files};
use arm_model::JointVector;
use shared_types::ipc::{ControllerMode, JointReport};
use shared_types::{FaultCode, MonotonicNs};
use std::fmt::Write;
use std::path::Path;

/// Table of the control cycles in a run folder.
pub const CYCLES_TABLE: &str = "cycles.csv";
/// Table of the measured joints in a run folder.
pub const JOINTS_TABLE: &str = "joints.csv";
/// Reports closer than this are one and the same (the fastest come every 4 ms).
const SAME_REPORT_NS: u64 = 1_000_000;
/// Columns of [`CYCLES_TABLE`].
const CYCLES_HEADER: &str = "cycle,deadline_s,mode,fault,sent,wake_late_us,compute_us,send_us,\
    reply_us,missed,dropped,trajectory_s,q1_c,q2_c,q3_c,q4_c,q5_c,q6_c,q7_c\n";

/// Measured joints (CLOCK_MONOTONIC ns, rad) in order of time, each report once.
pub fn measured(reports: &[JointReport]) -> Vec<(u64, JointVector)> {
    let mut out: Vec<(u64, JointVector)> = reports.iter().map(|r| (r.stamp_ns, r.q)).collect();
    out.sort_by_key(|(t, _)| *t);
    // A report is sent at once to a new listener and may repeat the last one.
    out.dedup_by(|next, kept| next.0 - kept.0 < SAME_REPORT_NS);
    out
}

impl Cycles {
    /// Writes [`CYCLES_TABLE`] and, where the arm reported its joints, [`JOINTS_TABLE`] into
    /// `folder`; times (s) count from `epoch_ns` (CLOCK_MONOTONIC).
    ///
    /// # Errors
    /// A table cannot be written.
    pub fn write_tables(&self, folder: &Path, epoch_ns: u64) -> Result<()> {
        let since = |ns: u64| MonotonicNs(ns).since_s(MonotonicNs(epoch_ns));
        let measured = measured(&self.joints);
        if measured.len() >= 2 {
            let rows = measured.iter().map(|(t, q)| (since(*t), *q));
            files::write_joints(&folder.join(JOINTS_TABLE), rows)?;
        }
        let mut text = CYCLES_HEADER.to_owned();
        for c in &self.cycles {
            write!(
                text,
                "{},{:.6},{},{:?},{},{:.1},{:.1},{:.1},{:.1},{},{},{:.6}",
                c.cycle,
                since(c.deadline_ns),
                mode_name(ControllerMode::from_raw(c.mode)),
                FaultCode::from_raw(c.fault).unwrap_or_default(),
                c.sent,
                f64::from(c.wake_late_ns) / 1e3,
                f64::from(c.compute_ns) / 1e3,
                f64::from(c.send_ns) / 1e3,
                f64::from(c.reply_ns) / 1e3,
                c.missed,
                c.dropped,
                c.trajectory_s,
            )?;
            for q in c.q_c.iter() {
                write!(text, ",{q:.9}")?;
            }
            text.push('\n');
        }
        files::write_atomic(&folder.join(CYCLES_TABLE), text.as_bytes())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::ipc::CycleRecord;

    #[test]
    fn tables_hold_one_row_per_cycle_and_report() {
        let report = |stamp_ns: u64, q1: f64| JointReport {
            stamp_ns,
            q: JointVector([q1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
            ..JointReport::default()
        };
        let cycle = CycleRecord {
            cycle: 7,
            deadline_ns: 2_004_000_000,
            mode: ControllerMode::Streaming as u8,
            sent: 1,
            wake_late_ns: 12_500,
            trajectory_s: -1.0,
            q_c: JointVector([0.5; 7]),
            ..CycleRecord::default()
        };
        let told = Cycles {
            cycles: vec![cycle],
            joints: vec![
                report(2_003_000_000, 0.2),
                report(1_999_000_000, 0.1),
                report(2_003_400_000, 0.2),
            ],
        };
        let folder = tempfile::tempdir().unwrap();
        told.write_tables(folder.path(), 2_000_000_000).unwrap();
        let joints = files::read_joints(&folder.path().join(JOINTS_TABLE)).unwrap();
        assert_eq!(joints.times_s, [-0.001, 0.003]);
        assert_eq!([joints.q[0][0], joints.q[1][0]], [0.1, 0.2]);
        let text = std::fs::read_to_string(folder.path().join(CYCLES_TABLE)).unwrap();
        let q = ",0.500000000".repeat(7);
        assert_eq!(
            text.lines().nth(1).unwrap(),
            format!("7,0.004000,Streaming,None,1,12.5,0.0,0.0,0.0,0,0,-1.000000{q}")
        );
        assert_eq!(text.lines().count(), 2);
    }
}
