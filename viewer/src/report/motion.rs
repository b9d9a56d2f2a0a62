//! Control cycles of a run, and the motions in them.

use anyhow::{Context, ensure};
use arm_model::JointVector;
use serde::Deserialize;
use std::path::Path;

/// Mode of the cycles of a motion that was asked for; moves to a start pose are
/// the controller's own.
const STREAMING: &str = "Streaming";
/// Fewer cycles than this are nothing to look at.
const CYCLES_MIN: usize = 25;

/// One line of `cycles.csv`.
#[derive(Debug, Clone, Deserialize)]
pub(crate) struct CycleRow {
    /// Instant of the setpoint (s from the run's epoch).
    pub deadline_s: f64,
    /// Mode.
    pub mode: String,
    /// Whether a setpoint was sent.
    pub sent: u8,
    /// Late wake-up (µs).
    pub wake_late_us: f64,
    /// Computing (µs).
    pub compute_us: f64,
    /// Wake-up to sent (µs).
    pub send_us: f64,
    /// Time on the motion (s).
    pub trajectory_s: f64,
    q1_c: f64,
    q2_c: f64,
    q3_c: f64,
    q4_c: f64,
    q5_c: f64,
    q6_c: f64,
    q7_c: f64,
}

impl CycleRow {
    /// Commanded joints (rad).
    pub(crate) const fn commanded(&self) -> JointVector {
        JointVector([
            self.q1_c, self.q2_c, self.q3_c, self.q4_c, self.q5_c, self.q6_c, self.q7_c,
        ])
    }

    fn is_finite(&self) -> bool {
        let times = [
            self.deadline_s,
            self.wake_late_us,
            self.compute_us,
            self.send_us,
            self.trajectory_s,
        ];
        times.iter().all(|v| v.is_finite()) && self.commanded().is_finite()
    }
}

/// Reads `cycles.csv`.
pub(crate) fn read_cycles(path: &Path) -> anyhow::Result<Vec<CycleRow>> {
    let name = path.display();
    let mut reader =
        csv::Reader::from_path(path).with_context(|| format!("cannot read `{name}`"))?;
    let mut rows: Vec<CycleRow> = Vec::new();
    for (index, row) in reader.deserialize().enumerate() {
        let line = index + 2;
        let row: CycleRow = row.with_context(|| format!("`{name}` line {line}"))?;
        ensure!(
            row.is_finite(),
            "`{name}` line {line}: a number is not finite"
        );
        rows.push(row);
    }
    Ok(rows)
}

/// The cycles of each motion, in order.
pub(crate) fn motions(rows: &[CycleRow]) -> Vec<&[CycleRow]> {
    rows.chunk_by(|a, b| a.mode == b.mode && b.trajectory_s >= a.trajectory_s)
        .filter(|run| run[0].mode == STREAMING && run.len() >= CYCLES_MIN)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_is_a_row_of_streaming_cycles() {
        let row = |mode: &str, t: f64| CycleRow {
            deadline_s: 0.0,
            mode: mode.to_owned(),
            sent: 1,
            wake_late_us: 0.0,
            compute_us: 0.0,
            send_us: 0.0,
            trajectory_s: t,
            q1_c: 0.0,
            q2_c: 0.0,
            q3_c: 0.0,
            q4_c: 0.0,
            q5_c: 0.0,
            q6_c: 0.0,
            q7_c: 0.0,
        };
        let run = |mode, count: u32| (0..count).map(move |i| row(mode, f64::from(i)));
        // The third and the fourth follow each other without a pause.
        let rows: Vec<CycleRow> = run("Moving", 60)
            .chain(run(STREAMING, 40))
            .chain(run("Idle", 30))
            .chain(run(STREAMING, 50))
            .chain(run(STREAMING, 30))
            .chain(run(STREAMING, 3))
            .collect();
        let lengths: Vec<usize> = motions(&rows).iter().map(|m| m.len()).collect();
        assert_eq!(lengths, [40, 50, 30]);
    }
}
