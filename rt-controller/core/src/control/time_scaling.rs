//! Time scaling: slows a motion down to rest without leaving its path.
//!
//! Time on the path runs at rate 1. To stop, the rate falls to zero as a smooth
//! step of length `T`, `r(u) = 1 - 3u² + 2u³` with `u = t / T`, so its second
//! derivative, and with it the jerk it adds, is bounded by `6 / T²`. Speeds of
//! joints and tool only fall; accelerations may rise, so the caller checks.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of float vectors only, which cannot overflow or panic"
)]

use super::motion::Motion;
use arm_model::JointState;
use serde::{Deserialize, Serialize};

/// A slow-down to rest along the path. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct SlowDown {
    /// Time on the path at its begin (s).
    pub from_s: f64,
    /// Time until rest (s).
    pub duration_s: f64,
}

impl SlowDown {
    /// Time on the path (s), its rate and the rate's derivative (1/s), `t_s`
    /// after the begin. RT-safe.
    #[must_use]
    pub fn at(&self, t_s: f64) -> (f64, f64, f64) {
        let u = (t_s / self.duration_s).clamp(0.0, 1.0);
        let path_s = self.from_s + self.duration_s * (u - u * u * u + u * u * u * u / 2.0);
        let rate = 1.0 - u * u * (3.0 - 2.0 * u);
        (path_s, rate, 6.0 * u * (u - 1.0) / self.duration_s)
    }

    /// Joint state `t_s` after the begin; at rest after the end. RT-safe.
    #[must_use]
    pub fn state_at(&self, motion: &Motion, t_s: f64) -> JointState {
        let (path_s, rate, change) = self.at(t_s);
        let on_path = motion.state_at(path_s);
        if t_s >= self.duration_s {
            return JointState::at_rest(on_path.q);
        }
        JointState {
            q: on_path.q,
            qd: on_path.qd.map(|v| v * rate),
            qdd: on_path
                .qdd
                .zip_with(on_path.qd, |a, v| a * (rate * rate) + v * change),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointTrajectory;
    use arm_model::joint::START_POSE;

    #[test]
    fn the_rate_falls_smoothly_and_half_the_time_is_spent_on_the_path() {
        let slow = SlowDown {
            from_s: 0.3,
            duration_s: 0.2,
        };
        assert_eq!(slow.at(0.0), (0.3, 1.0, 0.0));
        let (path_s, rate, change) = slow.at(0.2);
        assert!((path_s - 0.4).abs() < 1e-15);
        assert_eq!((rate, change), (0.0, 0.0));
        assert_eq!(slow.at(9.0), (path_s, 0.0, 0.0));
        for k in 1..200 {
            let (t, h) = (f64::from(k) * 1e-3, 1e-6);
            let ((p0, r0, _), (p1, r1, _)) = (slow.at(t - h), slow.at(t + h));
            assert!(((p1 - p0) / (2.0 * h) - slow.at(t).1).abs() < 1e-6);
            assert!(((r1 - r0) / (2.0 * h) - slow.at(t).2).abs() < 1e-5);
        }
    }

    #[test]
    fn its_states_are_derivatives_of_each_other() {
        let mut up = START_POSE;
        up[5] -= 0.6;
        let motion = Motion::Spline(
            JointTrajectory::new(&[0.0, 0.6, 1.2], &[START_POSE, up, START_POSE]).unwrap(),
        );
        let slow = SlowDown {
            from_s: 0.2,
            duration_s: 0.3,
        };
        let h = 1e-5;
        for k in 1..29 {
            let t = f64::from(k) * 0.01;
            let (a, o, b) = (
                slow.state_at(&motion, t - h),
                slow.state_at(&motion, t),
                slow.state_at(&motion, t + h),
            );
            assert!(((b.q - a.q) * (0.5 / h) - o.qd).max_abs() < 1e-6);
            assert!(((b.qd - a.qd) * (0.5 / h) - o.qdd).max_abs() < 1e-4);
        }
    }
}
