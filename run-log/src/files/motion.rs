//! Joint and pose motion as CSV files.

use super::text::cannot_read;
use anyhow::{Context, Result, bail, ensure};
use arm_model::{JOINTS, JointTrajectory, JointVector};
use rope_sim::PoseRow;
use std::path::Path;

/// Joint samples: times (s) and positions (rad).
#[derive(Debug, Clone, PartialEq)]
pub struct JointsCsv {
    /// Times (s), increasing.
    pub times_s: Vec<f64>,
    /// Positions (rad).
    pub q: Vec<JointVector>,
}

/// No joint of the arm turns as far as this (rad).
const JOINT_MAX_RAD: f64 = 7.5;

/// Reads a CSV whose first columns are those of `header`, all numbers finite
/// and the first one increasing.
pub fn read_table(path: &Path, header: &[&str]) -> Result<Vec<Vec<f64>>> {
    let name = path.display();
    let file = std::fs::File::open(path).map_err(cannot_read(path))?;
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .from_reader(file);
    let found = reader
        .headers()
        .with_context(|| format!("`{name}` is not a CSV file"))?
        .clone();
    ensure!(
        found.len() >= header.len() && header.iter().zip(&found).all(|(a, b)| *a == b),
        "`{name}`: the first line must name the columns {}, found {}",
        header.join(","),
        found.iter().collect::<Vec<_>>().join(",")
    );
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (i, record) in reader.records().enumerate() {
        let line = i + 2;
        let record = record.with_context(|| format!("`{name}` line {line}"))?;
        let mut row = Vec::with_capacity(header.len());
        for (column, text) in header.iter().zip(&record) {
            match text.parse::<f64>() {
                Ok(v) if v.is_finite() => row.push(v),
                _ => bail!(
                    "`{name}` line {line}, column `{column}`: `{text}` is not a finite number"
                ),
            }
        }
        if let Some(before) = rows.last().filter(|before| row[0] <= before[0]) {
            let (now, before) = (row[0], before[0]);
            bail!("`{name}` line {line}: time {now} s does not come after {before} s");
        }
        rows.push(row);
    }
    let count = rows.len();
    ensure!(
        count >= 2,
        "`{name}` needs at least two rows of numbers, found {count}"
    );
    Ok(rows)
}

/// Reads `t,q1..q7` (s, rad).
pub fn read_joints(path: &Path) -> Result<JointsCsv> {
    let rows = read_table(path, &["t", "q1", "q2", "q3", "q4", "q5", "q6", "q7"])?;
    for (i, row) in rows.iter().enumerate() {
        if let Some(q) = row[1..].iter().find(|q| q.abs() > JOINT_MAX_RAD) {
            bail!(
                "`{}` line {}: a joint at {q} rad, but none turns beyond {JOINT_MAX_RAD} rad; \
                 is the file in degrees?",
                path.display(),
                i + 2
            );
        }
    }
    Ok(JointsCsv {
        times_s: rows.iter().map(|r| r[0]).collect(),
        q: rows
            .iter()
            .map(|r| JointVector(std::array::from_fn(|j| r[j + 1])))
            .collect(),
    })
}

/// Writes `t,q1..q7` (s, rad).
pub fn write_joints(path: &Path, samples: impl Iterator<Item = (f64, JointVector)>) -> Result<()> {
    let mut text = String::from("t,q1,q2,q3,q4,q5,q6,q7\n");
    for (t, q) in samples {
        text.push_str(&format!("{t:.6}"));
        for j in 0..JOINTS {
            text.push_str(&format!(",{:.9}", q[j]));
        }
        text.push('\n');
    }
    super::atomic::write_atomic(path, text.as_bytes())
}

/// Writes a trajectory as joints at a rate, its last row at rest.
pub fn write_trajectory(path: &Path, trajectory: &JointTrajectory, period_s: f64) -> Result<()> {
    // A trajectory lasts at most ten minutes.
    let cycles = (trajectory.duration_s() / period_s).ceil() as u32;
    let rows = (0..=cycles).map(|i| {
        let t = f64::from(i) * period_s;
        (t, trajectory.state_at(t).q)
    });
    write_joints(path, rows)
}

/// Reads `t,x,y,z,qw,qx,qy,qz` (s, m, unit quaternion of the attach frame).
pub fn read_pose(path: &Path) -> Result<Vec<PoseRow>> {
    let rows = read_table(path, &["t", "x", "y", "z", "qw", "qx", "qy", "qz"])?;
    for (i, r) in rows.iter().enumerate() {
        let norm = r[4..8].iter().map(|v| v * v).sum::<f64>().sqrt();
        ensure!(
            (norm - 1.0).abs() < 1e-3,
            "`{}` line {}: quaternion qw,qx,qy,qz has length {norm:.4}, but must have length 1",
            path.display(),
            i + 2
        );
    }
    Ok(rows
        .iter()
        .map(|r| PoseRow {
            t_s: r[0],
            p_m: [r[1], r[2], r[3]],
            q_wxyz: [r[4], r[5], r[6], r[7]],
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn joints_come_back_as_written() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("j.csv");
        let q = JointVector([0.1, -0.2, 0.3, 1.0, 0.0, 1.5, -3.0]);
        write_joints(&path, [(0.0, q), (0.004, q * 2.0)].into_iter()).unwrap();
        let back = read_joints(&path).unwrap();
        assert_eq!(back.times_s, [0.0, 0.004]);
        assert!((back.q[1] - q * 2.0).max_abs() < 1e-9);
    }

    #[test]
    fn degrees_and_short_lines_are_named_with_their_line() {
        let rows = [
            ("1,0,0,90,0,0,0,0", "line 3: a joint at 90 rad"),
            ("1,0,0", "line 3"),
        ];
        for (row, words) in rows {
            let dir = tempfile::tempdir().unwrap();
            let path = dir.path().join("j.csv");
            let text = format!("t,q1,q2,q3,q4,q5,q6,q7\n0,0,0,0,0,0,0,0\n{row}\n");
            std::fs::write(&path, text).unwrap();
            let said = format!("{:#}", read_joints(&path).unwrap_err());
            assert!(said.contains(words), "{said}");
        }
    }

    /// `text` with up to three bytes changed, inserted or taken out.
    fn spoilt(text: &[u8], rng: &mut ChaCha8Rng) -> Vec<u8> {
        // Mostly digits, so that some tables are still tables.
        const OFTEN: &[u8] =
            b"01234567890123456789012345678901234567890123456789.eE,-+\n\r\"# NaNinf";
        let mut bytes = text.to_vec();
        for _ in 0..rng.random_range(1..=3) {
            let at = rng.random_range(0..bytes.len().max(1)).min(bytes.len());
            let byte = if rng.random_bool(0.8) {
                OFTEN[rng.random_range(0..OFTEN.len())]
            } else {
                rng.random()
            };
            match rng.random_range(0..3) {
                0 if at < bytes.len() => bytes[at] = byte,
                1 if at < bytes.len() => drop(bytes.remove(at)),
                _ => bytes.insert(at, byte),
            }
        }
        bytes
    }

    #[test]
    fn spoilt_tables_are_read_or_refused() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.csv");
        let rows = "0,1,2,3,4,5,6,7\n0.1,1,2,3,4,5,6,7\n";
        let joints = format!("t,q1,q2,q3,q4,q5,q6,q7\n{rows}");
        let pose = "t,x,y,z,qw,qx,qy,qz\n0,0.5,0,0.5,1,0,0,0\n0.1,0.5,0,0.5,0,1,0,0\n";
        let (mut read, mut refused) = (0, 0);
        for _ in 0..1000 {
            std::fs::write(&path, spoilt(joints.as_bytes(), &mut rng)).unwrap();
            match read_joints(&path) {
                Ok(table) => {
                    assert!(table.q.iter().all(JointVector::is_finite));
                    assert!(table.times_s.is_sorted_by(|a, b| a < b));
                    read += 1;
                }
                Err(error) => {
                    assert!(format!("{error:#}").contains("m.csv"), "{error:#}");
                    refused += 1;
                }
            }
            std::fs::write(&path, spoilt(pose.as_bytes(), &mut rng)).unwrap();
            if let Err(error) = read_pose(&path) {
                assert!(format!("{error:#}").contains("m.csv"), "{error:#}");
            }
        }
        assert!(read > 20 && refused > 100, "{read} {refused}");
    }
}
