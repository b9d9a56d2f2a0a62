//! Control cycles and measured joints as tables, which spreadsheets and `wag` itself read.

use crate::recorded::RecordedRun;
use crate::written::{Written, WrittenFile};
use anyhow::Context;
use cli_output::{OrInput, Outcome};
use run_log::{Cycles, files};
use serde_json::json;
use shared_types::ipc::ControllerMode;
use shared_types::{FaultCode, MonotonicNs};
use std::fmt::Write;
use std::path::Path;

/// Table of the control cycles.
const CYCLES_TABLE: &str = "cycles.csv";
/// Table of the measured joints.
const JOINTS_TABLE: &str = "joints.csv";
/// Columns of [`CYCLES_TABLE`].
const CYCLES_HEADER: &str = "cycle,deadline_s,mode,fault,sent,wake_late_us,compute_us,send_us,\
    reply_us,missed,dropped,trajectory_s,q1_c,q2_c,q3_c,q4_c,q5_c,q6_c,q7_c\n";

/// Writes `cycles.csv` and, where the arm reported its joints, `joints.csv` into the folder
/// `out`; times (s) count from the first frame of the wiggle's film, or else from the first cycle.
///
/// # Errors
/// The run cannot be read or holds no cycle, or the folder cannot be written to.
pub fn csv(run: &Path, out: Option<&Path>) -> Outcome<Written> {
    let recorded = RecordedRun::read(run)?;
    let out = out.unwrap_or(recorded.run.folder());
    std::fs::create_dir_all(out)
        .with_context(|| format!("cannot make the folder `{}`", out.display()))
        .or_input()?;
    files::check_writable(&out.join(CYCLES_TABLE)).or_input()?;
    let files = write_tables(&recorded.cycles, out, recorded.epoch_ns).or_failed()?;
    let rows = |file: usize| files.get(file).map_or(0, |file| file.count);
    let figures = json!({
        "epoch_ns": recorded.epoch_ns, "cycles": rows(0), "joints": rows(1), "folder": out,
    });
    let mut missing = recorded.flaws;
    missing.extend((files.len() < 2).then(|| JOINTS_TABLE.to_owned()));
    Ok(Written {
        run: run.to_owned(),
        files,
        figures,
        missing,
    })
}

/// Times (s) count from `epoch_ns` (CLOCK_MONOTONIC).
fn write_tables(found: &Cycles, folder: &Path, epoch_ns: u64) -> anyhow::Result<Vec<WrittenFile>> {
    let since = |ns: u64| MonotonicNs(ns).since_s(MonotonicNs(epoch_ns));
    let table = |name: &str, rows: usize| WrittenFile {
        path: folder.join(name),
        count: rows as u64,
        of: "rows",
    };
    let measured = found.joints_between(0, u64::MAX);
    let mut written = vec![table(CYCLES_TABLE, found.cycles.len())];
    if measured.len() >= 2 {
        let rows = measured.iter().map(|(t, q)| (since(*t), *q));
        written.push(table(JOINTS_TABLE, measured.len()));
        files::write_joints(&written[1].path, rows)?;
    }
    let mut text = CYCLES_HEADER.to_owned();
    for c in &found.cycles {
        write!(
            text,
            "{},{:.6},{:?},{:?},{},{:.1},{:.1},{:.1},{:.1},{},{},{:.6}",
            c.cycle,
            since(c.deadline_ns),
            ControllerMode::from_raw(c.mode),
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
    files::write_atomic(&written[0].path, text.as_bytes())?;
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;
    use shared_types::ipc::{CycleRecord, JointReport};

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
        let reported = Cycles {
            cycles: vec![cycle],
            joints: vec![
                report(2_003_000_000, 0.2),
                report(1_999_000_000, 0.1),
                report(2_003_400_000, 0.2),
            ],
        };
        let folder = tempfile::tempdir().unwrap();
        let written = write_tables(&reported, folder.path(), 2_000_000_000).unwrap();
        assert_eq!([written[0].count, written[1].count], [1, 2]);
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
