//! The last gate before the wire: no setpoint passes that breaks a limit.
//!
//! Velocity, acceleration and jerk are divided differences of the setpoints that
//! were really sent, at the times they were planned for. By the mean value
//! theorem those never exceed the largest derivative of the curve they sample,
//! so a curve within its limits always passes, missed cycles or not, and
//! nothing else does.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of float vectors only, which cannot overflow or panic"
)]

use super::violation::Violation;
use arm_model::limits::STEP_MAX_M;
use arm_model::{JOINTS, JointVector, Limits};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use shared_types::FaultCode;

/// Relative slack.
const RELATIVE: f64 = 1e-9;
/// Rounding of positions (rad), and what one, two and three divisions by a
/// period make of it (rad/s, rad/s², rad/s³).
const ROUNDING: [f64; 4] = [1e-9, 1e-9, 1e-8, 1e-5];
/// After a longer pause the arm stands at the last setpoint (s): below 30 Hz its
/// motion is not continuous.
pub const CONTINUOUS_S: f64 = 1.0 / 30.0;
/// Setpoints that a divided difference of third order looks back on.
const WINDOW: u8 = 3;

/// What may differ from motion to motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allowance {
    /// Largest tool speed (m/s).
    pub tcp_speed_max_m_s: f64,
    /// An uploaded trajectory: a clamped spline steps its acceleration at both
    /// ends, so the jerk between setpoints may come to one full acceleration
    /// per cycle. Motions the controller makes itself keep the jerk limit.
    pub streamed: bool,
}

/// What was sent last, and how fast that was. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Limiter {
    q: JointVector,
    qd: JointVector,
    qdd: JointVector,
    step_s: f64,
    step_before_s: f64,
    p_w_tcp_m: Vector3<f64>,
    streamed_left: u8,
}

impl Limiter {
    /// At rest in `q`.
    #[must_use]
    pub fn at_rest(q: JointVector, limits: &Limits) -> Self {
        Self {
            q,
            qd: JointVector::ZERO,
            qdd: JointVector::ZERO,
            step_s: limits.period_s(),
            step_before_s: limits.period_s(),
            p_w_tcp_m: limits.tool_centre_point_m(&q),
            streamed_left: 0,
        }
    }

    /// Speed of the newest step (rad/s).
    #[must_use]
    pub const fn speed(&self) -> JointVector {
        self.qd
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
        allowed: &Allowance,
    ) -> Result<(), Violation> {
        if !q.is_finite() || !step_s.is_finite() || step_s <= 0.0 {
            return Err(Violation::plain(FaultCode::SetpointNotFinite));
        }
        self.check_pause(q, step_s, limits, allowed)?;
        let streamed_left = if allowed.streamed {
            WINDOW
        } else {
            self.streamed_left.saturating_sub(1)
        };
        let qd = (*q - self.q) * (1.0 / step_s);
        let qdd = (qd - self.qd) * (2.0 / (step_s + self.step_s));
        let jerk = (qdd - self.qdd) * (3.0 / (step_s + self.step_s + self.step_before_s));
        for j in 0..JOINTS {
            check_position(j, q[j], limits)?;
            let speed_max = limits.velocity_max_rad_s[j];
            let acceleration_max = limits.acceleration_max_rad_s2[j];
            let jerk_max = if streamed_left > 0 {
                limits.jerk_max_rad_s3[j] + acceleration_max / limits.period_s()
            } else {
                limits.jerk_max_rad_s3[j]
            };
            let [_, of_speed, of_acceleration, of_jerk] = ROUNDING;
            let (qdd_j, jerk_j) = (qdd[j], jerk[j]);
            for (fault, value, limit, slack) in [
                (FaultCode::SetpointVelocity, qd[j], speed_max, of_speed),
                (
                    FaultCode::SetpointAcceleration,
                    qdd_j,
                    acceleration_max,
                    of_acceleration,
                ),
                (FaultCode::SetpointJerk, jerk_j, jerk_max, of_jerk),
            ] {
                if !within(value, limit, slack) {
                    return Err(Violation::of_joint(fault, j, value, limit));
                }
            }
        }
        let p_w_tcp_m = limits.tool_centre_point_m(q);
        check_tool((p_w_tcp_m - self.p_w_tcp_m).norm(), step_s, limits, allowed)?;
        *self = Self {
            q: *q,
            qd,
            qdd,
            step_s,
            step_before_s: self.step_s,
            p_w_tcp_m,
            streamed_left,
        };
        Ok(())
    }

    /// After a pause the arm sets out from rest, however long the pause was: it
    /// must be able to get to the setpoint as if only the longest continuous
    /// interval had passed.
    fn check_pause(
        &self,
        q: &JointVector,
        step_s: f64,
        limits: &Limits,
        allowed: &Allowance,
    ) -> Result<(), Violation> {
        if step_s <= CONTINUOUS_S {
            return Ok(());
        }
        let [_, slack, ..] = ROUNDING;
        let qd = (*q - self.q) * (1.0 / CONTINUOUS_S);
        let way_m = (limits.tool_centre_point_m(q) - self.p_w_tcp_m).norm();
        let reached = (0..JOINTS).all(|j| within(qd[j], limits.velocity_max_rad_s[j], slack))
            && within(way_m / CONTINUOUS_S, allowed.tcp_speed_max_m_s, slack);
        if reached {
            return Ok(());
        }
        let missed = |span_s: f64| span_s / limits.period_s() - 1.0;
        let (found, most) = (missed(step_s), missed(CONTINUOUS_S));
        Err(Violation::new(FaultCode::DeadlineMissed, found, most))
    }
}

fn check_position(j: usize, q_rad: f64, limits: &Limits) -> Result<(), Violation> {
    let (low, high) = (limits.position_min_rad[j], limits.position_max_rad[j]);
    let [slack, ..] = ROUNDING;
    if q_rad >= low - slack && q_rad <= high + slack {
        return Ok(());
    }
    let limit = if q_rad < low { low } else { high };
    let fault = FaultCode::SetpointPosition;
    Err(Violation::of_joint(fault, j, q_rad, limit))
}

fn check_tool(
    way_m: f64,
    step_s: f64,
    limits: &Limits,
    allowed: &Allowance,
) -> Result<(), Violation> {
    let [_, slack, ..] = ROUNDING;
    let speed_m_s = way_m / step_s;
    if !within(speed_m_s, allowed.tcp_speed_max_m_s, slack) {
        let armed_for_less = allowed.tcp_speed_max_m_s < limits.tcp_speed_max_m_s;
        let fault = if armed_for_less {
            FaultCode::OperatingModeExceeded
        } else {
            FaultCode::SetpointTcpSpeed
        };
        return Err(Violation::new(fault, speed_m_s, allowed.tcp_speed_max_m_s));
    }
    // Per cycle also where cycles were missed.
    let step_max_m = STEP_MAX_M * (step_s / limits.period_s()).max(1.0);
    if within(way_m, step_max_m, slack) {
        Ok(())
    } else {
        Err(Violation::new(FaultCode::SetpointStep, way_m, step_max_m))
    }
}

/// False for NaN, too.
fn within(value: f64, limit: f64, rounding: f64) -> bool {
    value.abs() <= limit * (1.0 + RELATIVE) + rounding
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointTrajectory;
    use arm_model::joint::START_POSE;

    use FaultCode as F;

    const PERIOD_S: f64 = 0.004;
    const STREAMED: Allowance = Allowance {
        tcp_speed_max_m_s: 1.2,
        streamed: true,
    };

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
            limiter
                .admit(&trajectory.state_at(t).q, step, limits, &STREAMED)
                .map_err(|found| found.fault)?;
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
    /// step at both ends: exactly at the limit it must pass, above it must not. Its
    /// peak speed is `1.5 x / T`. Joint 1 swings the flange round the base at its
    /// distance from it.
    #[test]
    fn splines_at_a_limit_pass_and_above_it_fail() {
        let limits = Limits::default();
        let reach_m = arm_model::kinematics::flange_pose(&START_POSE)
            .0
            .xy()
            .norm();
        let by = 1.05 * 1.2 / reach_m / 1.5;
        let at_limit = swing(6, 20.0 * 0.25 / 6.0, 0.5);
        let above = swing(6, 20.6 * 0.25 / 6.0, 0.5);
        for (trajectory, every, expected) in [
            (at_limit, 5, Ok(())),
            (at_limit, 7, Ok(())),
            (at_limit, 1000, Ok(())),
            (above, 1000, Err(F::SetpointAcceleration)),
            (swing(6, 3.2, 1.5), 1000, Err(F::SetpointVelocity)),
            (swing(0, by, 1.0), 1000, Err(F::SetpointTcpSpeed)),
            (swing(0, by * 0.94, 1.0), 9, Ok(())),
        ] {
            assert_eq!(run(&trajectory, &limits, every), expected);
        }
    }

    /// Joint `j` moved by `by_rad` within `step_s`, from rest.
    fn step(j: usize, by_rad: f64, step_s: f64, allowed: Allowance) -> Result<(), Violation> {
        let limits = Limits::default();
        let mut q = START_POSE;
        q[j] += by_rad;
        let at_rest = Limiter::at_rest(START_POSE, &limits);
        let mut limiter = at_rest;
        let taken = limiter.admit(&q, step_s, &limits, &allowed);
        assert!(
            taken.is_ok() || limiter == at_rest,
            "a refusal leaves no trace"
        );
        taken
    }

    /// An operating mode is slower than the limits. 200 ms of silence: 90 mrad can be
    /// reached at 180 deg/s within 1/30 s, 110 cannot, although either is slow over the
    /// whole pause.
    #[test]
    fn a_jump_or_nonsense_never_passes() {
        let slow = Allowance {
            tcp_speed_max_m_s: 0.01,
            ..STREAMED
        };
        let quick = 0.5 * PERIOD_S * PERIOD_S * 20.0;
        let outside = -0.2 - START_POSE[3];
        for (j, by_rad, step_s, allowed, fault) in [
            (6, 0.001, PERIOD_S, STREAMED, F::SetpointAcceleration),
            (3, f64::NAN, PERIOD_S, STREAMED, F::SetpointNotFinite),
            (0, 0.0, 0.0, STREAMED, F::SetpointNotFinite),
            (3, outside, PERIOD_S, STREAMED, F::SetpointPosition),
            (0, quick, PERIOD_S, slow, F::OperatingModeExceeded),
            (6, 0.11, 0.2, STREAMED, F::DeadlineMissed),
        ] {
            assert_eq!(step(j, by_rad, step_s, allowed).unwrap_err().fault, fault);
        }
        assert_eq!(
            step(6, 0.11, 0.2, STREAMED).unwrap_err().value.round(),
            49.0
        );
        assert_eq!(step(6, 0.09, 0.2, STREAMED), Ok(()));
    }

    /// A setpoint whose jerk alone is too large for a motion of the controller's
    /// own passes as part of an uploaded trajectory.
    #[test]
    fn only_streamed_trajectories_may_step_their_acceleration() {
        let own = Allowance {
            streamed: false,
            ..STREAMED
        };
        let by_rad = 10.0 * PERIOD_S * PERIOD_S;
        let found = step(6, by_rad, PERIOD_S, own).unwrap_err();
        assert_eq!((found.fault, found.joint), (F::SetpointJerk, 7));
        assert!((found.value - 2500.0).abs() < 1e-3 && found.limit == 500.0);
        assert_eq!(step(6, by_rad, PERIOD_S, STREAMED), Ok(()));
    }
}
