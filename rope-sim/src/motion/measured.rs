//! The arm as its joint encoders reported it.

use super::{AttachMotion, MotionError, check_times, not_finite};
use arm_model::kinematics::FrameMotion;
use arm_model::{JOINTS, JointState, JointVector, Pole};

/// Knot spacing of the fitted spline (s): short enough for the arm's bandwidth,
/// long enough that encoder noise does not become acceleration.
const KNOT_S: f64 = 0.020;

/// Weight of squared third differences of the control points against squared joint
/// errors. It fills gaps in the stamps and damps what the arm cannot do (25 Hz);
/// it changes a 2 Hz motion by less than 1e-5 of itself.
const ROUGHNESS: f64 = 0.05;

/// Longest accepted log (s).
const MAX_SPAN_S: f64 = 600.0;

/// Attach frame of an arm whose joints were measured, perhaps with noise (1e-4 rad)
/// and irregular stamps (100-250 Hz): least-squares cubic B-spline with 20 ms knots.
/// Beyond the data it turns into rest within three knots, smoothly.
#[derive(Debug, Clone)]
pub struct MeasuredArm {
    first_s: f64,
    last_s: f64,
    /// Control points; point i has most weight at `first_s + (i - 1) KNOT_S`.
    control: Vec<[f64; JOINTS]>,
    pole: Pole,
}

impl MeasuredArm {
    /// Fits joint angles `q` (rad) at `times_s`, of an arm with this pole on its flange.
    ///
    /// # Errors
    /// Fewer than eight samples, unequal lengths, times that do not increase or span
    /// more than ten minutes, numbers that are not finite.
    pub fn new(times_s: &[f64], q: &[JointVector], pole: Pole) -> Result<Self, MotionError> {
        if times_s.len() != q.len() {
            return Err(MotionError(format!(
                "`times_s` has {} entries but `q` has {}",
                times_s.len(),
                q.len()
            )));
        }
        check_times(8, times_s.iter().copied())?;
        if let Some(index) = q.iter().position(|v| !v.is_finite()) {
            return Err(not_finite(index));
        }
        let (first_s, last_s) = (times_s[0], times_s[times_s.len() - 1]);
        let span_s = last_s - first_s;
        if span_s > MAX_SPAN_S {
            return Err(MotionError(format!(
                "the samples span {span_s} s; at most {MAX_SPAN_S} s are accepted"
            )));
        }
        let control = fit(first_s, span_s, times_s, q);
        Ok(Self {
            first_s,
            last_s,
            control,
            pole,
        })
    }

    /// Joint state at `t_s`.
    #[must_use]
    pub fn joints_at(&self, t_s: f64) -> JointState {
        // Far outside, all four control points are the same one.
        let last = self.control.len() as f64 + 3.0;
        let x = ((t_s - self.first_s) / KNOT_S).clamp(-4.0, last);
        let whole = x.floor();
        let [value, slope, curvature] = basis(x - whole);
        let mut out = JointState::default();
        for i in 0..4 {
            let point = &self.control[self.clamped(whole as i64 + i as i64)];
            for j in 0..JOINTS {
                out.q[j] += value[i] * point[j];
                out.qd[j] += slope[i] * point[j] / KNOT_S;
                out.qdd[j] += curvature[i] * point[j] / (KNOT_S * KNOT_S);
            }
        }
        out
    }

    fn clamped(&self, index: i64) -> usize {
        usize::try_from(index)
            .unwrap_or(0)
            .min(self.control.len() - 1)
    }
}

impl AttachMotion for MeasuredArm {
    fn at(&self, t_s: f64) -> FrameMotion {
        self.pole.attach_motion(&self.joints_at(t_s))
    }

    fn joints_at(&self, t_s: f64) -> Option<JointState> {
        Some(self.joints_at(t_s))
    }

    fn pole(&self) -> Option<Pole> {
        Some(self.pole)
    }

    fn duration_s(&self) -> f64 {
        self.last_s
    }
}

/// Weights of the four control points at the fraction `u` of a knot interval: value,
/// first and second derivative (per interval).
fn basis(u: f64) -> [[f64; 4]; 3] {
    let v = 1.0 - u;
    [
        [
            v * v * v / 6.0,
            (4.0 + u * u * (3.0 * u - 6.0)) / 6.0,
            (4.0 + v * v * (3.0 * v - 6.0)) / 6.0,
            u * u * u / 6.0,
        ],
        [
            -v * v / 2.0,
            u * (1.5 * u - 2.0),
            -v * (1.5 * v - 2.0),
            u * u / 2.0,
        ],
        [v, 3.0 * u - 2.0, 3.0 * v - 2.0, u],
    ]
}

/// Control points by banded normal equations. Angles are fitted relative to the
/// first sample, which keeps digits and makes the roughness term exact at rest.
fn fit(first_s: f64, span_s: f64, times_s: &[f64], q: &[JointVector]) -> Vec<[f64; JOINTS]> {
    let intervals = (span_s / KNOT_S).ceil().max(1.0) as usize;
    let count = intervals + 3;
    let mut matrix = vec![[0.0; 4]; count];
    let mut right = vec![[0.0; JOINTS]; count];
    for (t_s, sample) in times_s.iter().zip(q) {
        let x = (t_s - first_s) / KNOT_S;
        let interval = (x.floor() as usize).min(intervals - 1);
        let [value, ..] = basis(x - interval as f64);
        for i in 0..4 {
            for k in 0..=i {
                matrix[interval + i][i - k] += value[i] * value[k];
            }
            for j in 0..JOINTS {
                right[interval + i][j] += value[i] * (sample[j] - q[0][j]);
            }
        }
    }
    let third_difference = [-1.0, 3.0, -3.0, 1.0];
    for start in 0..count - 3 {
        for i in 0..4 {
            for k in 0..=i {
                matrix[start + i][i - k] += ROUGHNESS * third_difference[i] * third_difference[k];
            }
        }
    }
    solve_banded(&mut matrix, &mut right);
    for point in &mut right {
        for j in 0..JOINTS {
            point[j] += q[0][j];
        }
    }
    right
}

/// Solves a symmetric positive definite system of half bandwidth 3 in place by
/// Cholesky; `matrix[i][d]` is the element of row i, column i - d.
fn solve_banded(matrix: &mut [[f64; 4]], right: &mut [[f64; JOINTS]]) {
    let n = matrix.len();
    for i in 0..n {
        for d in (0..=3.min(i)).rev() {
            let k = i - d;
            let mut sum = matrix[i][d];
            for e in d + 1..=3.min(i) {
                sum -= matrix[i][e] * matrix[k].get(e - d).copied().unwrap_or(0.0);
            }
            matrix[i][d] = if d == 0 {
                sum.max(1e-300).sqrt()
            } else {
                sum / matrix[k][0]
            };
        }
        for j in 0..JOINTS {
            let known: f64 = (1..=3.min(i)).map(|d| matrix[i][d] * right[i - d][j]).sum();
            right[i][j] = (right[i][j] - known) / matrix[i][0];
        }
    }
    for i in (0..n).rev() {
        for j in 0..JOINTS {
            let known: f64 = (1..=3.min(n - 1 - i))
                .map(|d| matrix[i + d][d] * right[i + d][j])
                .sum();
            right[i][j] = (right[i][j] - known) / matrix[i][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    /// A 1.5 Hz wiggle with soft ends, sampled irregularly at about 200 Hz.
    fn samples(noise_rad: f64) -> (Vec<f64>, Vec<JointVector>) {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(7);
        let mut t = 0.0;
        let mut times = Vec::new();
        let mut joints = Vec::new();
        while t < 3.0 {
            times.push(t);
            joints.push(
                truth(t)
                    .q
                    .map(|v| v + noise_rad * random.random_range(-1.7..1.7)),
            );
            t += random.random_range(0.003..0.007);
        }
        (times, joints)
    }

    fn truth(t: f64) -> JointState {
        let w = core::f64::consts::TAU * 1.5;
        let scale = |f: f64| JointVector::splat(0.3 * f);
        JointState {
            q: scale((w * t).sin()),
            qd: scale(w * (w * t).cos()),
            qdd: scale(-w * w * (w * t).sin()),
        }
    }

    #[test]
    fn noise_free_motion_is_recovered_with_its_acceleration() {
        let (times, joints) = samples(0.0);
        let arm = MeasuredArm::new(&times, &joints, Pole::default()).unwrap();
        for i in 10..290 {
            let t = f64::from(i) * 0.01;
            let (got, want) = (arm.joints_at(t), truth(t));
            assert!((got.q - want.q).max_abs() < 1e-5, "{t}");
            assert!((got.qd - want.qd).max_abs() < 3e-3, "{t}");
            assert!((got.qdd - want.qdd).max_abs() < 0.5, "{t}");
        }
    }

    #[test]
    fn encoder_noise_leaves_accelerations_usable() {
        let (times, joints) = samples(1e-4);
        let arm = MeasuredArm::new(&times, &joints, Pole::default()).unwrap();
        let mut sum = 0.0;
        for i in 0..2800 {
            let t = 0.1 + f64::from(i) * 0.001;
            let d = arm.joints_at(t).qdd - truth(t).qdd;
            sum += d[3] * d[3];
        }
        let rms = (sum / 2800.0).sqrt();
        assert!(rms < 1.0, "acceleration error {rms} rad/s² of 27");
    }

    #[test]
    fn derivatives_belong_to_the_positions_everywhere() {
        let (times, joints) = samples(1e-4);
        let arm = MeasuredArm::new(&times, &joints, Pole::default()).unwrap();
        let d = 1e-6;
        for t in [-0.05, -0.011, 0.0, 0.5, 2.99, 3.03, 3.2] {
            let (a, b, c) = (arm.joints_at(t - d), arm.joints_at(t), arm.joints_at(t + d));
            assert!(((c.q - a.q) * (0.5 / d) - b.qd).max_abs() < 1e-4, "{t}");
            assert!(((c.qd - a.qd) * (0.5 / d) - b.qdd).max_abs() < 1e-1, "{t}");
        }
        assert_eq!(arm.joints_at(99.0).qd.max_abs(), 0.0);
        assert_eq!(arm.joints_at(-99.0).qd.max_abs(), 0.0);
    }

    #[test]
    fn bad_logs_are_named() {
        type Spoil = fn(&mut Vec<f64>, &mut Vec<JointVector>);
        let bad: [(Spoil, &str); 3] = [
            (|times, _| times.truncate(9), "`times_s` has 9 entries"),
            (|_, joints| joints[12][3] = f64::NAN, "sample 12 holds"),
            (|times, _| times[6] = times[4], "sample 6 is not after"),
        ];
        for (change, words) in bad {
            let (mut times, mut joints) = samples(0.0);
            change(&mut times, &mut joints);
            let refusal = MeasuredArm::new(&times, &joints, Pole::default()).unwrap_err();
            assert!(refusal.to_string().contains(words), "{refusal}");
        }
    }
}
