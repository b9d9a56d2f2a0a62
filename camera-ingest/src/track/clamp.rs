//! Where the clamp (the rope's attach frame) is while the camera records.

use std::path::{Path, PathBuf};

use arm_model::kinematics::FrameMotion;
use arm_model::{JointVector, Pole};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rope_sim::AttachMotion;

/// Why a path of the clamp is refused.
#[derive(Debug, thiserror::Error)]
pub enum ClampError {
    /// The file cannot be read.
    #[error("clamp path {path}: {source} (check the path and its permissions)")]
    Io {
        /// File concerned.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// A row does not parse.
    #[error("clamp path {path}, line {line}: {reason}; expected columns t,x,y,z,qw,qx,qy,qz")]
    Row {
        /// File concerned.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// What is wrong.
        reason: String,
    },
    /// Empty, or times do not increase.
    #[error("clamp path: {0}")]
    Samples(&'static str),
}

/// One pose of the attach frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClampSample {
    /// Time since the start of exposure of the first frame (s).
    pub t_s: f64,
    /// Origin of the attach frame in the world: where the rope leaves the clamp (m).
    pub p_w_m: Vector3<f64>,
    /// Unit vector from the clamp back along the pole (+z of the attach frame).
    pub pole_w: Vector3<f64>,
}

/// Poses of the attach frame over time.
#[derive(Debug, Clone, PartialEq)]
pub struct ClampPath {
    samples: Vec<ClampSample>,
}

impl ClampPath {
    /// From samples in order of time.
    ///
    /// # Errors
    /// No samples, numbers that are not finite, or times that do not increase.
    pub fn new(samples: Vec<ClampSample>) -> Result<Self, ClampError> {
        if samples.is_empty() {
            return Err(ClampError::Samples("it has no samples"));
        }
        if samples.iter().any(|s| {
            !s.t_s.is_finite()
                || !s.p_w_m.iter().all(|v| v.is_finite())
                || !s.pole_w.iter().all(|v| v.is_finite())
        }) {
            return Err(ClampError::Samples("a number in it is not finite"));
        }
        if samples.windows(2).any(|w| w[1].t_s <= w[0].t_s) {
            return Err(ClampError::Samples("its times do not increase"));
        }
        Ok(Self { samples })
    }

    /// From joint positions in order of time (t = 0: first frame), through the kinematics
    /// of the arm with this pole.
    ///
    /// # Errors
    /// As [`ClampPath::new`].
    pub fn from_joints(joints: &[(f64, JointVector)], pole: &Pole) -> Result<Self, ClampError> {
        Self::new(
            joints
                .iter()
                .map(|(t_s, q)| {
                    let (p_w_m, r) = pole.attach_pose(q);
                    ClampSample {
                        t_s: *t_s,
                        p_w_m,
                        pole_w: r.column(2).into(),
                    }
                })
                .collect(),
        )
    }

    /// From a CSV file with columns `t,x,y,z,qw,qx,qy,qz` (s, m, unit
    /// quaternion attach frame to world).
    ///
    /// # Errors
    /// The file is missing or a row does not parse; as [`ClampPath::new`].
    pub fn from_pose_csv(path: &Path) -> Result<Self, ClampError> {
        let text = std::fs::read_to_string(path).map_err(|source| ClampError::Io {
            path: path.to_owned(),
            source,
        })?;
        let mut samples = Vec::new();
        for (index, row) in text.lines().enumerate().skip(1) {
            if row.trim().is_empty() {
                continue;
            }
            let fail = |reason: String| ClampError::Row {
                path: path.to_owned(),
                line: index + 1,
                reason,
            };
            let numbers: Vec<f64> = row
                .split(',')
                .map(|c| c.trim().parse())
                .collect::<Result<_, _>>()
                .map_err(|e| fail(format!("{e}")))?;
            let [t_s, x, y, z, qw, qx, qy, qz] = numbers[..] else {
                return Err(fail(format!("{} columns", numbers.len())));
            };
            let q = Quaternion::new(qw, qx, qy, qz);
            if (q.norm() - 1.0).abs() > 1e-2 {
                return Err(fail(format!("quaternion of length {:.3}", q.norm())));
            }
            samples.push(ClampSample {
                t_s,
                p_w_m: Vector3::new(x, y, z),
                pole_w: UnitQuaternion::from_quaternion(q) * Vector3::z(),
            });
        }
        Self::new(samples)
    }

    /// The samples in order of time.
    #[must_use]
    pub fn samples(&self) -> &[ClampSample] {
        &self.samples
    }

    /// The same path with its times from another zero, `zero_s` on this one's clock.
    #[must_use]
    pub fn since(&self, zero_s: f64) -> Self {
        let samples = self.samples.iter().map(|s| ClampSample {
            t_s: s.t_s - zero_s,
            ..*s
        });
        Self {
            samples: samples.collect(),
        }
    }

    /// Pose at a time, linear between samples, the end poses outside.
    #[must_use]
    pub fn at(&self, t_s: f64) -> ClampSample {
        let after = self.samples.partition_point(|s| s.t_s <= t_s);
        if after == 0 {
            return ClampSample {
                t_s,
                ..self.samples[0]
            };
        }
        let a = self.samples[after - 1];
        let Some(b) = self.samples.get(after) else {
            return ClampSample { t_s, ..a };
        };
        let part = (t_s - a.t_s) / (b.t_s - a.t_s);
        ClampSample {
            t_s,
            p_w_m: a.p_w_m.lerp(&b.p_w_m, part),
            pole_w: a.pole_w.lerp(&b.pole_w, part).normalize(),
        }
    }
}

impl AttachMotion for ClampPath {
    fn at(&self, t_s: f64) -> FrameMotion {
        let ClampSample { p_w_m, pole_w, .. } = ClampPath::at(self, t_s);
        let turn = UnitQuaternion::rotation_between(&Vector3::z(), &pole_w);
        FrameMotion {
            p_m: p_w_m,
            r: turn.unwrap_or_default().to_rotation_matrix().into_inner(),
            ..FrameMotion::world()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(t_s: f64, x: f64) -> ClampSample {
        ClampSample {
            t_s,
            p_w_m: Vector3::new(x, 0.0, 1.0),
            pole_w: Vector3::z(),
        }
    }

    #[test]
    fn interpolates_and_holds_the_ends() {
        let path = ClampPath::new(vec![sample(0.0, 0.0), sample(0.5, 1.0)]).unwrap();
        assert_eq!(path.at(0.25).p_w_m.x, 0.5);
        assert_eq!(path.at(-1.0).p_w_m.x, 0.0);
        assert_eq!(path.at(9.0).p_w_m.x, 1.0);
    }

    #[test]
    fn disorder_is_refused() {
        assert!(ClampPath::new(vec![]).is_err());
        assert!(ClampPath::new(vec![sample(0.1, 0.0), sample(0.1, 0.0)]).is_err());
        assert!(ClampPath::new(vec![sample(0.1, f64::NAN)]).is_err());
    }
}
