//! How the clamp moved in a film.

use crate::files::{self, JointsCsv};
use crate::mcap_file::GAP_NS;
use anyhow::{Context, Result, bail, ensure};
use arm_model::Pole;
use rope_sim::{AttachMotion, MeasuredArm, PoseTrack};
use std::path::{Path, PathBuf};

/// So much of a film may lie before or after the motion that is recorded (s): the arm stands when
/// a recording begins and ends.
const UNRECORDED_S: f64 = 0.5;

/// How the clamp moved, on the film's clock: t = 0 is the first frame.
#[derive(Debug)]
pub struct ClampMotion {
    /// The file that it is from.
    path: PathBuf,
    /// Measured joints in it; else it has the attach frame's poses.
    joints: Option<JointsCsv>,
    pole: Pole,
    /// How late the film's times are on the motion's (s).
    late_s: f64,
}

impl ClampMotion {
    /// That of `joints` with this pole; without them that of the poses in the file at `path`.
    /// The film's times are `late_s` late on the motion's.
    #[must_use]
    pub fn new(path: &Path, joints: Option<JointsCsv>, pole: Pole, late_s: f64) -> Self {
        Self {
            path: path.to_owned(),
            joints,
            pole,
            late_s,
        }
    }

    /// The pole that carries the clamp, where its motion is that of joints.
    #[must_use]
    pub fn pole(&self) -> Option<&Pole> {
        self.joints.as_ref().map(|_| &self.pole)
    }

    /// Refuses a motion that tells of a part of the film only; before and after it the clamp
    /// would be taken to stand still, and in a gap its motion would be guessed.
    ///
    /// # Errors
    /// That, or a file of poses that cannot be read.
    pub fn check_covers(&self, film_s: f64) -> Result<()> {
        let times_s: Vec<f64> = match &self.joints {
            Some(csv) => csv.times_s.clone(),
            None => files::read_pose(&self.path)?
                .iter()
                .map(|row| row.t_s)
                .collect(),
        };
        let [first_s, last_s] = [times_s.first(), times_s.last()]
            .map(|t_s| t_s.map_or(f64::NAN, |t_s| t_s + self.late_s));
        ensure!(
            first_s <= UNRECORDED_S && last_s >= film_s - UNRECORDED_S,
            "`{}` tells the clamp's motion from {first_s:.2} to {last_s:.2} s, but the film lasts from 0 to {film_s:.2} s: record the motion for all of the film, or give its time with --film-late-ms",
            self.path.display()
        );
        let late_s = self.late_s;
        let longest_s = GAP_NS as f64 * 1e-9;
        let is_long = |[from_s, to_s]: &[f64; 2]| {
            to_s - from_s > longest_s && *to_s > 0.0 && *from_s < film_s
        };
        let mut pairs = times_s.windows(2).map(|t| [t[0] + late_s, t[1] + late_s]);
        let gap = pairs.find(is_long);
        gap.map_or(Ok(()), |[from_s, to_s]| {
            bail!(
                "`{}` has no motion of the clamp from {from_s:.2} to {to_s:.2} s: record it without a gap of more than {longest_s} s",
                self.path.display()
            )
        })
    }

    /// For tracker and simulator.
    ///
    /// # Errors
    /// Times or numbers that make no motion, a file of poses that cannot be read.
    pub fn attach(&self) -> Result<Box<dyn AttachMotion + Send>> {
        let file = || format!("`{}`", self.path.display());
        if let Some(csv) = &self.joints {
            let times_s: Vec<f64> = csv.times_s.iter().map(|t| t + self.late_s).collect();
            let arm = MeasuredArm::new(&times_s, &csv.q, self.pole).with_context(file)?;
            return Ok(Box::new(arm));
        }
        let mut rows = files::read_pose(&self.path)?;
        for row in &mut rows {
            row.t_s += self.late_s;
        }
        Ok(Box::new(PoseTrack::new(&rows).with_context(file)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;

    #[test]
    fn a_gap_in_the_motion_is_refused_where_the_film_shows_it() {
        let pose = |t_s: &f64| JointVector([0.0, -0.1, 0.0, 1.0, 0.0, 1.0, *t_s * 1e-3]);
        let check = |late_s: f64| {
            let steps = (0..=100).filter(|i| !(51..=70).contains(i));
            let times_s: Vec<f64> = steps.map(|i| 0.02 * f64::from(i)).collect();
            let q = times_s.iter().map(pose).collect();
            let joints = JointsCsv { times_s, q };
            let path = Path::new("joints.csv");
            ClampMotion::new(path, Some(joints), Pole::default(), late_s).check_covers(0.9)
        };
        let refusal = check(-0.5).unwrap_err().to_string();
        assert!(refusal.contains("from 0.50 to 0.92 s"), "{refusal}");
        assert!(check(0.0).is_ok());
    }

    /// Poses from one time to another.
    fn poses(folder: &Path, from_s: f64, to_s: f64) -> ClampMotion {
        let mut text = "t,x,y,z,qw,qx,qy,qz\n".to_owned();
        for i in 0..=100 {
            let t_s = from_s + (to_s - from_s) * f64::from(i) / 100.0;
            text.push_str(&format!("{t_s},0,0,1,1,0,0,0\n"));
        }
        let path = folder.join("pose.csv");
        std::fs::write(&path, text).unwrap();
        ClampMotion::new(&path, None, Pole::default(), 0.0)
    }

    #[test]
    fn a_motion_of_a_part_of_the_film_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let check = |from_s, to_s| poses(folder.path(), from_s, to_s).check_covers(6.7);
        assert!(check(0.0, 6.7).is_ok() && check(-1.0, 8.0).is_ok() && check(0.3, 6.4).is_ok());
        for (from_s, to_s) in [(0.0, 0.2), (6.5, 6.7), (1.0, 8.0)] {
            let refusal = check(from_s, to_s).unwrap_err().to_string();
            assert!(
                refusal.contains("pose.csv") && refusal.contains("6.70 s"),
                "{refusal}"
            );
        }
    }
}
