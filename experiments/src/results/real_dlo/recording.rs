//! A recording: where a rope is held, and where its tip is.

use anyhow::{Context, ensure};
use nalgebra::{UnitQuaternion, Vector3};
use rope_sim::{MotionError, PoseRow, PoseTrack};
use run_log::files;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// First columns of a file: time (s), place (m) and angles (rad) of the base, its velocities and
/// accelerations, then the places of the middle and of the end (m), all in the robot's base frame.
const COLUMNS: [&str; 25] = [
    "t",
    "p_b_x",
    "p_b_y",
    "p_b_z",
    "phi_b_z",
    "phi_b_y",
    "phi_b_x",
    "dp_b_x",
    "dp_b_y",
    "dp_b_z",
    "dphi_b_z",
    "dphi_b_y",
    "dphi_b_x",
    "ddp_b_x",
    "ddp_b_y",
    "ddp_b_z",
    "ddphi_b_z",
    "ddphi_b_y",
    "ddphi_b_x",
    "p_m_x",
    "p_m_y",
    "p_m_z",
    "p_e_x",
    "p_e_y",
    "p_e_z",
];
/// The base moves once it is farther from its first pose than this (m, rad).
const MOVED_M: f64 = 2e-3;
const TURNED_RAD: f64 = 2e-3;

/// One recording, from rest.
#[derive(Debug, Clone)]
pub(super) struct Recording {
    /// The file's, without its ending.
    pub name: String,
    /// From 0 (s).
    times_s: Vec<f64>,
    base: Vec<(Vector3<f64>, UnitQuaternion<f64>)>,
    /// The end's marker in each row (m).
    pub tip_m: Vec<Vector3<f64>>,
    /// First row in which the base has moved.
    pub moves_from: usize,
}

impl Recording {
    /// Reads a file of the authors' form.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let rows = files::read_table(path, &COLUMNS)?;
        let name = path.display();
        let place = |row: &[f64]| Vector3::new(row[0], row[1], row[2]);
        let base = |row: &Vec<f64>| {
            // Rz(phi_z) Ry(phi_y) Rx(phi_x).
            let attitude = UnitQuaternion::from_euler_angles(row[6], row[5], row[4]);
            (place(&row[1..]), attitude)
        };
        let base: Vec<_> = rows.iter().map(base).collect();
        let has_moved = |(p, attitude): &(Vector3<f64>, UnitQuaternion<f64>)| {
            (p - base[0].0).norm() > MOVED_M || attitude.angle_to(&base[0].1) > TURNED_RAD
        };
        let moves_from = base.iter().position(has_moved);
        let stem = path.file_stem().unwrap_or_default();
        let recording = Self {
            name: stem.to_string_lossy().into_owned(),
            times_s: rows.iter().map(|row| row[0] - rows[0][0]).collect(),
            moves_from: moves_from.with_context(|| format!("`{name}`: the base never moves"))?,
            base,
            tip_m: rows.iter().map(|row| place(&row[22..])).collect(),
        };
        let is_even = |t: &[f64]| (t[1] - t[0] - recording.period_s()).abs() < 1e-6;
        ensure!(
            recording.times_s.windows(2).all(is_even),
            "`{name}`: its rows must be evenly spaced in time"
        );
        Ok(recording)
    }

    /// Time of the last row (s).
    pub fn duration_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Time between rows (s).
    pub fn period_s(&self) -> f64 {
        self.duration_s() / (self.times_s.len() - 1) as f64
    }

    /// Motion of the attach frame of a rope that leaves along the base's x axis, turned about
    /// its y axis and then its own z axis by these angles (rad).
    pub fn motion(&self, [tilt_y, tilt_z]: [f64; 2]) -> Result<PoseTrack, MotionError> {
        let about = |axis, angle| UnitQuaternion::from_axis_angle(&axis, angle);
        let (y, z) = (Vector3::y_axis(), Vector3::z_axis());
        let attach = about(y, tilt_y) * about(z, tilt_z) * about(y, -FRAC_PI_2);
        let pairs = self.times_s.iter().zip(&self.base);
        let row = |(t_s, (p, attitude)): (&f64, &(Vector3<f64>, UnitQuaternion<f64>))| {
            let q = (attitude * attach).into_inner();
            PoseRow {
                t_s: *t_s,
                p_m: (*p).into(),
                q_wxyz: [q.w, q.i, q.j, q.k],
            }
        };
        PoseTrack::new(&pairs.map(row).collect::<Vec<_>>())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use rope_sim::AttachMotion;
    use std::fmt::Write;

    /// A base (m, rad: about z, y, x) that swings along y and turns about x after half a second.
    pub(in super::super) fn base(t_s: f64) -> ([f64; 3], [f64; 3]) {
        let since = (t_s - 0.5).max(0.0);
        let swing = 0.1 * (6.0 * since).sin() * (1.0 - (-5.0 * since).exp());
        ([0.4, swing, 0.6], [0.0, -0.4, 2.0 * swing])
    }

    /// A file with this base and tip, 250 rows a second.
    pub(in super::super) fn write(path: &Path, tip_m: &[Vector3<f64>]) {
        let mut text = COLUMNS.join(",");
        for (row, tip) in tip_m.iter().enumerate() {
            let t_s = 0.004 * row as f64;
            let ([x, y, z], [about_z, about_y, about_x]) = base(t_s);
            let zeros = ",0".repeat(15);
            let [tx, ty, tz]: [f64; 3] = (*tip).into();
            let time = 2.0 + t_s;
            let angles = format!("{about_z},{about_y},{about_x}");
            write!(text, "\n{time},{x},{y},{z},{angles}{zeros},{tx},{ty},{tz}").unwrap();
        }
        std::fs::write(path, text).unwrap();
    }

    /// The recording with this base and tip.
    pub(in super::super) fn recorded(tip_m: &[Vector3<f64>]) -> Recording {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("traj1.csv");
        write(&path, tip_m);
        Recording::read(&path).unwrap()
    }

    #[test]
    fn the_rope_leaves_along_the_base_s_turned_x_axis() {
        let recording = recorded(&[Vector3::new(1.0, 2.0, 3.0); 300]);
        assert_eq!(recording.name, "traj1");
        assert_eq!(recording.tip_m[299], Vector3::new(1.0, 2.0, 3.0));
        assert!((recording.duration_s() - 1.196).abs() < 1e-9);
        assert!((125..150).contains(&recording.moves_from));
        let leaves = |tilt| {
            let attach = recording.motion(tilt).unwrap().at(0.0);
            -attach.r.column(2).into_owned()
        };
        // Turned about y by -0.4, x points up; by 0.4 more, it is level.
        let up = Vector3::new(0.4_f64.cos(), 0.0, 0.4_f64.sin());
        assert!((leaves([0.0, 0.0]) - up).norm() < 1e-9);
        assert!((leaves([0.4, 0.0]) - Vector3::x()).norm() < 1e-9);
        let aside = Vector3::new(0.1_f64.cos(), 0.1_f64.sin(), 0.0);
        assert!((leaves([0.4, 0.1]) - aside).norm() < 1e-9);
    }

    #[test]
    fn what_is_no_recording_is_refused_by_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("traj1.csv");
        let refused = |text: &str| {
            std::fs::write(&path, text).unwrap();
            let why = format!("{:#}", Recording::read(&path).unwrap_err());
            assert!(why.contains("traj1.csv"), "{why}");
            why
        };
        write(&path, &[Vector3::zeros(); 300]);
        let text = std::fs::read_to_string(&path).unwrap();
        let short = text.lines().take(100).collect::<Vec<_>>().join("\n");
        assert!(refused(&short).contains("never moves"));
        let gap: Vec<&str> = (text.lines().enumerate())
            .filter_map(|(i, line)| (i != 200).then_some(line))
            .collect();
        assert!(refused(&gap.join("\n")).contains("evenly spaced"));
        assert!(refused(&text.replace("p_m_x", "p_q_x")).contains("p_m_x"));
    }
}
