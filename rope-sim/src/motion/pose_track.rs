//! Attach frame from sampled poses, joined by a C2 spline.

use super::{AttachMotion, MotionError, check_times, not_finite};
use arm_model::kinematics::FrameMotion;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// One row of a pose table: time, origin, attitude of the attach frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseRow {
    /// Time (s).
    pub t_s: f64,
    /// Origin in the world (m).
    pub p_m: [f64; 3],
    /// Attitude, frame to world, unit quaternion, scalar first.
    pub q_wxyz: [f64; 4],
}

/// Attach frame through sampled poses: cubic interpolating splines through position
/// and quaternion components, so accelerations are continuous and are those of the
/// interpolated pose. Meant for dense (about 1 kHz), nearly noise-free poses: it
/// goes through every sample, so a staircase of setpoints in them becomes acceleration.
#[derive(Debug, Clone)]
pub struct PoseTrack {
    t_s: Vec<f64>,
    /// Position, then quaternion scalar first.
    values: Vec<[f64; 7]>,
    /// Second derivatives at the samples.
    curvatures: Vec<[f64; 7]>,
}

impl PoseTrack {
    /// Spline through `rows`.
    ///
    /// # Errors
    /// Fewer than four rows, times that do not increase, numbers that are not
    /// finite, quaternions far from unit length.
    pub fn new(rows: &[PoseRow]) -> Result<Self, MotionError> {
        check_times(4, rows.iter().map(|r| r.t_s))?;
        let mut values: Vec<[f64; 7]> = Vec::with_capacity(rows.len());
        for (index, row) in rows.iter().enumerate() {
            let [x, y, z] = row.p_m;
            let norm = row.q_wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
            if !(x.is_finite() && y.is_finite() && z.is_finite() && norm.is_finite()) {
                return Err(not_finite(index));
            }
            if (norm - 1.0).abs() > 0.01 {
                return Err(MotionError(format!(
                    "quaternion of sample {index} has length {norm}; it must be 1 within 1 %"
                )));
            }
            let mut q = row.q_wxyz.map(|v| v / norm);
            if let Some(before) = values.last() {
                // q and -q are one attitude; neighbours must be on one side.
                if q.iter().zip(&before[3..]).map(|(a, b)| a * b).sum::<f64>() < 0.0 {
                    q = q.map(|v| -v);
                }
            }
            values.push([x, y, z, q[0], q[1], q[2], q[3]]);
        }
        let t_s: Vec<f64> = rows.iter().map(|r| r.t_s).collect();
        let curvatures = spline_curvatures(&t_s, &values);
        Ok(Self {
            t_s,
            values,
            curvatures,
        })
    }

    /// Value, first and second derivative of the seven channels.
    fn channels(&self, t_s: f64) -> [[f64; 7]; 3] {
        let last = self.t_s.len() - 1;
        let i = self.t_s.partition_point(|t| *t <= t_s).clamp(1, last) - 1;
        let h = self.t_s[i + 1] - self.t_s[i];
        let (a, b) = (self.t_s[i + 1] - t_s, t_s - self.t_s[i]);
        let mut out = [[0.0; 7]; 3];
        for c in 0..7 {
            let (y0, y1) = (self.values[i][c], self.values[i + 1][c]);
            let (m0, m1) = (self.curvatures[i][c], self.curvatures[i + 1][c]);
            let slope = (y1 - y0) / h;
            out[0][c] = y0 + b * slope - a * b * ((a + h) * m0 + (b + h) * m1) / (6.0 * h);
            out[1][c] =
                slope + ((3.0 * b * b - h * h) * m1 - (3.0 * a * a - h * h) * m0) / (6.0 * h);
            out[2][c] = (m0 * a + m1 * b) / h;
        }
        out
    }
}

impl AttachMotion for PoseTrack {
    /// Before the first and after the last row: the pose there, at rest.
    fn at(&self, t_s: f64) -> FrameMotion {
        let clamped = t_s.clamp(self.t_s[0], self.t_s[self.t_s.len() - 1]);
        let outside = (clamped - t_s).abs() > 1e-9;
        let [x, v, a] = self.channels(clamped);
        let motion = frame_motion(&x, &v, &a);
        if outside {
            return FrameMotion {
                p_m: motion.p_m,
                r: motion.r,
                ..FrameMotion::world()
            };
        }
        motion
    }

    fn duration_s(&self) -> f64 {
        self.t_s[self.t_s.len() - 1]
    }

    fn holds_after_end(&self) -> bool {
        false
    }
}

/// Frame motion from position and (not exactly unit) quaternion and their
/// derivatives: with `p = q' / q`, `w = 2 vec p` and `w' = 2 vec(q'' / q - p p)`.
fn frame_motion(x: &[f64; 7], v: &[f64; 7], a: &[f64; 7]) -> FrameMotion {
    let quaternion = |c: &[f64; 7]| Quaternion::new(c[3], c[4], c[5], c[6]);
    let vector = |c: &[f64; 7]| Vector3::new(c[0], c[1], c[2]);
    let q = quaternion(x);
    let inverse = q.conjugate() / q.norm_squared();
    let p = quaternion(v) * inverse;
    let w = p.imag() * 2.0;
    FrameMotion {
        p_m: vector(x),
        r: UnitQuaternion::from_quaternion(q)
            .to_rotation_matrix()
            .into_inner(),
        v_m_s: vector(v),
        w_rad_s: w,
        a_m_s2: vector(a),
        alpha_rad_s2: (quaternion(a) * inverse).imag() * 2.0 - w * (2.0 * p.w),
    }
}

/// Second derivatives of the interpolating cubic spline; at both ends that of the
/// cubic through the four outermost samples.
fn spline_curvatures(t: &[f64], y: &[[f64; 7]]) -> Vec<[f64; 7]> {
    let last = t.len() - 1;
    let mut m = vec![[0.0; 7]; t.len()];
    m[0] = end_curvature([0, 1, 2, 3].map(|i| (t[i], y[i])));
    m[last] = end_curvature([0, 1, 2, 3].map(|i| (t[last - i], y[last - i])));
    // Thomas elimination of h0 m[i-1] + 2 (h0 + h1) m[i] + h1 m[i+1] = 6 (slope change).
    let mut upper = vec![0.0; t.len()];
    for i in 1..last {
        let (h0, h1) = (t[i] - t[i - 1], t[i + 1] - t[i]);
        let pivot = 2.0 * (h0 + h1) - h0 * upper[i - 1];
        upper[i] = h1 / pivot;
        for c in 0..7 {
            let change = (y[i + 1][c] - y[i][c]) / h1 - (y[i][c] - y[i - 1][c]) / h0;
            m[i][c] = (6.0 * change - h0 * m[i - 1][c]) / pivot;
        }
    }
    for i in (1..last).rev() {
        for c in 0..7 {
            m[i][c] -= upper[i] * m[i + 1][c];
        }
    }
    m
}

/// Second derivative, at the first of four samples, of the cubic through them.
fn end_curvature(samples: [(f64, [f64; 7]); 4]) -> [f64; 7] {
    let t = samples.map(|s| s.0);
    core::array::from_fn(|c| {
        let mut d = samples.map(|s| s.1[c]);
        for order in 1..4 {
            for i in (order..4).rev() {
                d[i] = (d[i] - d[i - 1]) / (t[i] - t[i - order]);
            }
        }
        2.0 * (d[2] + d[3] * ((t[0] - t[1]) + (t[0] - t[2])))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turning(t: f64) -> PoseRow {
        // Turns about a fixed axis by the angle t^2 while moving along a cubic.
        let half = 0.5 * t * t;
        let (s, c) = half.sin_cos();
        PoseRow {
            t_s: t,
            p_m: [t * t * t, -t, 0.5],
            q_wxyz: [c, 0.6 * s, 0.0, 0.8 * s],
        }
    }

    #[test]
    fn known_motion_comes_back_with_its_derivatives() {
        let rows: Vec<_> = (0..=1500).map(|i| turning(f64::from(i) * 1e-3)).collect();
        let track = PoseTrack::new(&rows).unwrap();
        for t in [0.0, 0.0404, 0.7, 1.2345, 1.5] {
            let m = track.at(t);
            assert!((m.p_m - Vector3::new(t * t * t, -t, 0.5)).norm() < 1e-10);
            assert!((m.v_m_s - Vector3::new(3.0 * t * t, -1.0, 0.0)).norm() < 1e-8);
            assert!((m.a_m_s2 - Vector3::new(6.0 * t, 0.0, 0.0)).norm() < 1e-5);
            let axis = Vector3::new(0.6, 0.0, 0.8);
            assert!(
                (m.w_rad_s - axis * (2.0 * t)).norm() < 1e-7,
                "{}",
                m.w_rad_s
            );
            assert!(
                (m.alpha_rad_s2 - axis * 2.0).norm() < 1e-4,
                "{}",
                m.alpha_rad_s2
            );
        }
    }

    #[test]
    fn sign_of_a_quaternion_does_not_matter() {
        let mut rows: Vec<_> = (0..100).map(|i| turning(f64::from(i) * 1e-2)).collect();
        let want = PoseTrack::new(&rows).unwrap().at(0.505);
        for row in rows.iter_mut().step_by(3) {
            row.q_wxyz = row.q_wxyz.map(|v| -v);
        }
        assert!((PoseTrack::new(&rows).unwrap().at(0.505).r - want.r).norm() < 1e-12);
    }

    #[test]
    fn bad_rows_are_named() {
        let rows: Vec<_> = (0..9).map(|i| turning(f64::from(i))).collect();
        let with = |index: usize, change: fn(&mut PoseRow)| {
            let mut rows = rows.clone();
            change(&mut rows[index]);
            PoseTrack::new(&rows)
        };
        let tripled = |r: &mut PoseRow| r.q_wxyz = r.q_wxyz.map(|v| v * 3.0);
        for (track, words) in [
            (with(3, |r| r.t_s = 1.0), "sample 3 is not after"),
            (with(4, |r| r.p_m[1] = f64::NAN), "sample 4 holds"),
            (with(5, tripled), "quaternion of sample 5"),
            (PoseTrack::new(&rows[..3]), "at least 4 samples, found 3"),
        ] {
            let refusal = track.unwrap_err().to_string();
            assert!(refusal.contains(words), "{refusal}");
        }
    }
}
