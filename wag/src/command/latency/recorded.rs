//! A recorded run as evidence: `cycles.csv`, `joints.csv` and, where a rope was
//! identified, the camera's offset from `params.toml`.

use super::Evidence;
use crate::files;
use anyhow::{Context, anyhow, ensure};
use arm_model::JOINTS;
use shared_types::ipc::{CycleRecord, JointReport};
use std::path::Path;

/// Times in a run may be negative by some seconds; records count from here (s).
const EPOCH_S: f64 = 1e4;

/// Reads a run folder.
///
/// # Errors
/// Missing or damaged files, by name, line and column.
pub(super) fn read(run: &Path) -> anyhow::Result<Evidence> {
    ensure!(
        run.is_dir(),
        "run folder `{}` does not exist; name one that `wag` wrote",
        run.display()
    );
    let cycles = read_cycles(&run.join("cycles.csv"))?;
    let joints = files::read_joints(&run.join("joints.csv"))?;
    let reports = joints
        .times_s
        .iter()
        .zip(&joints.q)
        .map(|(t_s, q)| JointReport {
            stamp_ns: nanoseconds(*t_s),
            q: *q,
            ..JointReport::default()
        })
        .collect();
    Ok(Evidence {
        source: format!("run {}", run.display()),
        folder: run.to_owned(),
        cycles,
        reports,
        // The table of joints does not hold them.
        has_targets: false,
        excitation: None,
        camera_offset_s: camera_offset_s(&run.join("params.toml"))?,
    })
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, as a time before the epoch should"
)]
fn nanoseconds(t_s: f64) -> u64 {
    ((t_s + EPOCH_S) * 1e9) as u64
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "saturates, as a latency beyond four seconds should"
)]
fn latency_ns(us: f64) -> u32 {
    (us * 1e3) as u32
}

fn read_cycles(path: &Path) -> anyhow::Result<Vec<CycleRecord>> {
    let name = path.display();
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_path(path)
        .with_context(|| {
            format!("cannot read `{name}`; name the folder of a run that moved an arm")
        })?;
    let header = reader
        .headers()
        .with_context(|| format!("`{name}` is not a CSV file"))?
        .clone();
    let mut rows = Vec::new();
    for (i, row) in reader.records().enumerate() {
        let row = row.with_context(|| format!("`{name}` line {}", i + 2))?;
        let number = |column: &str| -> anyhow::Result<f64> {
            let at = header
                .iter()
                .position(|h| h == column)
                .ok_or_else(|| anyhow!("`{name}` has no column `{column}`"))?;
            row.get(at)
                .and_then(|text| text.parse().ok())
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| {
                    anyhow!(
                        "`{name}` line {}, column `{column}`: not a finite number",
                        i + 2
                    )
                })
        };
        let mut cycle = CycleRecord {
            deadline_ns: nanoseconds(number("deadline_s")?),
            sent: u8::from(number("sent")? != 0.0),
            wake_late_ns: latency_ns(number("wake_late_us")?),
            compute_ns: latency_ns(number("compute_us")?),
            send_ns: latency_ns(number("send_us")?),
            reply_ns: latency_ns(number("reply_us")?),
            missed: latency_ns(number("missed")? * 1e-3),
            ..CycleRecord::default()
        };
        for joint in 0..JOINTS {
            cycle.q_c[joint] = number(&format!("q{}_c", joint + 1))?;
        }
        rows.push(cycle);
    }
    Ok(rows)
}

/// The offset that `wag identify` and `wag demo` leave in their result.
fn camera_offset_s(path: &Path) -> anyhow::Result<Option<f64>> {
    if !path.is_file() {
        return Ok(None);
    }
    let table: toml::Table = toml::from_str(&files::read_text(path)?)
        .with_context(|| format!("`{}`", path.display()))?;
    Ok(table
        .get("fit")
        .and_then(|fit| fit.get("time_offset_s"))
        .and_then(toml::Value::as_float))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const HEADER: &str = "cycle,deadline_s,mode,fault,sent,wake_late_us,compute_us,send_us,reply_us,missed,dropped,trajectory_s,q1_c,q2_c,q3_c,q4_c,q5_c,q6_c,q7_c\n";

    fn run(cycles: &str) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("cycles.csv"), cycles).unwrap();
        let joints = "t,q1,q2,q3,q4,q5,q6,q7\n-0.001,0,0,0,0,0,0,0\n0.003,0,0,0,0,0,0,0.5\n";
        std::fs::write(dir.path().join("joints.csv"), joints).unwrap();
        dir
    }

    #[test]
    fn cycles_and_joints_share_one_clock() {
        let row = "7,0.004,Streaming,None,1,12.5,3.0,20.1,310.0,2,0,-1,1,2,3,4,5,6,7\n";
        let dir = run(&format!("{HEADER}{row}"));
        std::fs::write(
            dir.path().join("params.toml"),
            "[fit]\ntime_offset_s = -0.0031\n",
        )
        .unwrap();
        let evidence = read(dir.path()).unwrap();
        let cycle = evidence.cycles[0];
        assert_eq!(
            (cycle.wake_late_ns, cycle.reply_ns, cycle.missed),
            (12_500, 310_000, 2)
        );
        assert_eq!(cycle.q_c[6], 7.0);
        let apart_ns = cycle.deadline_ns.abs_diff(evidence.reports[0].stamp_ns);
        assert!(apart_ns.abs_diff(5_000_000) < 10_000, "{apart_ns}");
        assert_eq!(evidence.camera_offset_s, Some(-0.0031));
    }

    #[test]
    fn damaged_runs_are_refused_with_file_line_and_column() {
        let said = |dir: &Path| format!("{:#}", read(dir).err().unwrap());
        assert!(said(Path::new("none/such")).contains("none/such"));
        let dir = run(&HEADER.replace("reply_us,", ""));
        assert!(read(dir.path()).is_ok(), "no rows, nothing missing yet");
        let bad = "7,0.004,Streaming,None,1,12.5,3.0,x,310.0,2,0,-1,1,2,3,4,5,6,7\n";
        let dir = run(&format!("{HEADER}{bad}"));
        let line = said(dir.path());
        assert!(
            line.contains("line 2") && line.contains("send_us"),
            "{line}"
        );
        std::fs::remove_file(dir.path().join("cycles.csv")).unwrap();
        assert!(said(dir.path()).contains("cycles.csv"));
    }

    #[test]
    fn spoilt_runs_are_read_or_refused() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let row = "7,0.004,Streaming,None,1,12.5,3.0,20.1,310.0,2,0,-1,1,2,3,4,5,6,7\n";
        let whole = format!("{HEADER}{row}{row}");
        let dir = run(&whole);
        for _ in 0..1000 {
            let mut bytes = whole.clone().into_bytes();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..bytes.len());
                bytes[at] = rng.random();
            }
            std::fs::write(dir.path().join("cycles.csv"), bytes).unwrap();
            if let Err(error) = read(dir.path()) {
                assert!(format!("{error:#}").contains("cycles.csv"), "{error:#}");
            }
        }
    }
}
