//! The last gate before the wire: no setpoint passes that breaks a limit.
//!
//! Velocity and acceleration are divided differences of the setpoints that
//! were really sent, at the times they were planned for. By the mean value
//! theorem those never exceed the largest derivative of the curve they sample,
//! so a curve within its limits always passes, missed cycles or not, and
//! nothing else does.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of float vectors only, which cannot overflow or panic"
)]

use nalgebra::Vector3;
use shared_types::{FaultCode, JOINTS, JointVector, Limits, kinematics};

/// Relative slack for rounding.
const RELATIVE: f64 = 1e-6;
/// Absolute slack: rounding of positions (1e-15 rad) divided by a period twice.
const ABSOLUTE: f64 = 1e-6;

/// What was sent last, and how fast that was. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limiter {
    q: JointVector,
    qd: JointVector,
    step_s: f64,
    p_w_tcp_m: Vector3<f64>,
}

impl Limiter {
    /// At rest in `q`.
    #[must_use]
    pub fn at_rest(q: JointVector, limits: &Limits) -> Self {
        Self {
            q,
            qd: JointVector::ZERO,
            step_s: limits.period_s(),
            p_w_tcp_m: tcp(&q, limits),
        }
    }

    /// Checks the setpoint that follows `step_s` after the last one and, when
    /// it passes, remembers it as sent. RT-safe.
    ///
    /// # Errors
    /// The limit it breaks; then nothing is remembered.
    pub fn admit(
        &mut self,
        q: &JointVector,
        step_s: f64,
        limits: &Limits,
    ) -> Result<(), FaultCode> {
        if !q.is_finite() || !step_s.is_finite() || step_s <= 0.0 {
            return Err(FaultCode::SetpointNotFinite);
        }
        if limits.position_violation(q).is_some() {
            return Err(FaultCode::SetpointPosition);
        }
        let qd = (*q - self.q) * (1.0 / step_s);
        let qdd = (qd - self.qd) * (2.0 / (step_s + self.step_s));
        for j in 0..JOINTS {
            if !within(qd[j], limits.velocity_max_rad_s[j]) {
                return Err(FaultCode::SetpointVelocity);
            }
            if !within(qdd[j], limits.acceleration_max_rad_s2[j]) {
                return Err(FaultCode::SetpointAcceleration);
            }
        }
        let p_w_tcp_m = tcp(q, limits);
        let speed_m_s = (p_w_tcp_m - self.p_w_tcp_m).norm() / step_s;
        if !within(speed_m_s, limits.tcp_speed_max_m_s) {
            return Err(FaultCode::SetpointTcpSpeed);
        }
        *self = Self {
            q: *q,
            qd,
            step_s,
            p_w_tcp_m,
        };
        Ok(())
    }
}

/// False for NaN, too.
fn within(value: f64, limit: f64) -> bool {
    value.abs() <= limit * (1.0 + RELATIVE) + ABSOLUTE
}

fn tcp(q: &JointVector, limits: &Limits) -> Vector3<f64> {
    let (p, r) = kinematics::flange_pose(q);
    p + r * limits.tcp_offset()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::JointTrajectory;
    use shared_types::plan::START_POSE;

    const PERIOD_S: f64 = 0.004;

    fn swing(joint: usize, by_rad: f64, in_s: f64) -> JointTrajectory {
        let mut end = START_POSE;
        end[joint] += by_rad;
        JointTrajectory::new(&[0.0, in_s], &[START_POSE, end]).unwrap()
    }

    fn run(trajectory: &JointTrajectory, limits: &Limits, every: usize) -> Result<(), FaultCode> {
        let mut limiter = Limiter::at_rest(trajectory.start(), limits);
        let mut t = 0.0;
        let mut step = PERIOD_S;
        let mut cycle = 0_usize;
        while t < trajectory.duration_s() + 0.02 {
            limiter.admit(&trajectory.state_at(t).q, step, limits)?;
            cycle += 1;
            step = if cycle.is_multiple_of(every) {
                3.0 * PERIOD_S
            } else {
                PERIOD_S
            };
            t += step;
        }
        Ok(())
    }

    /// A single clamped segment has its largest acceleration, `6 x / T²`, as a
    /// step at both ends: exactly at the limit it must pass, above it must not.
    #[test]
    fn a_spline_at_its_acceleration_limit_passes_and_above_it_fails() {
        let limits = Limits::default();
        for every in [5, 7, 1000] {
            let at_limit = swing(6, 20.0 * 0.25 / 6.0, 0.5);
            assert_eq!(run(&at_limit, &limits, every), Ok(()));
            let above = swing(6, 20.6 * 0.25 / 6.0, 0.5);
            assert_eq!(
                run(&above, &limits, 1000),
                Err(FaultCode::SetpointAcceleration)
            );
        }
    }

    #[test]
    fn speed_of_joint_and_tool_is_limited() {
        let limits = Limits::default();
        // Peak speed of a clamped segment is 1.5 x / T.
        assert_eq!(
            run(&swing(6, 3.2, 1.5), &limits, 1000),
            Err(FaultCode::SetpointVelocity)
        );
        // Joint 1 swings the flange round the base at its distance from it.
        let reach_m = kinematics::flange_pose(&START_POSE).0.xy().norm();
        let by = 1.05 * 1.2 / reach_m / 1.5;
        assert_eq!(
            run(&swing(0, by, 1.0), &limits, 1000),
            Err(FaultCode::SetpointTcpSpeed)
        );
        assert_eq!(run(&swing(0, by * 0.94, 1.0), &limits, 9), Ok(()));
    }

    #[test]
    fn a_jump_or_nonsense_never_passes_and_leaves_no_trace() {
        let limits = Limits::default();
        let mut limiter = Limiter::at_rest(START_POSE, &limits);
        let before = limiter;
        let mut jump = START_POSE;
        jump[6] += 0.001;
        assert_eq!(
            limiter.admit(&jump, PERIOD_S, &limits),
            Err(FaultCode::SetpointAcceleration)
        );
        let mut bad = START_POSE;
        bad[3] = f64::NAN;
        assert_eq!(
            limiter.admit(&bad, PERIOD_S, &limits),
            Err(FaultCode::SetpointNotFinite)
        );
        assert_eq!(
            limiter.admit(&START_POSE, 0.0, &limits),
            Err(FaultCode::SetpointNotFinite)
        );
        bad[3] = -0.2;
        assert_eq!(
            limiter.admit(&bad, PERIOD_S, &limits),
            Err(FaultCode::SetpointPosition)
        );
        assert_eq!(limiter, before);
    }
}
