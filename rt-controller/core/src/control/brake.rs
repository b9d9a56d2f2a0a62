//! The brake: from any commanded state to rest, jerk-limited, in closed form.
//!
//! Each joint takes the fastest way to zero velocity and zero acceleration
//! under its own acceleration and jerk limit: ramp the acceleration to a peak,
//! hold it, ramp it back. It needs no iteration and no memory, so a brake is
//! always available; there is nothing that could refuse.

use super::phases::{AxisPhases, AxisState, MAX_PHASES, Phase, PhasedMotion};
use super::violation::Violation;
use arm_model::{JOINTS, JointState, Limits, exact};
use shared_types::FaultCode;

/// Brake of all joints from `from` to rest; `jerk_max` gives the jerk of each
/// joint, 0-based (rad/s³). RT-safe.
#[must_use]
pub fn brake_with_jerk(
    from: &JointState,
    limits: &Limits,
    jerk_max: impl Fn(usize) -> f64,
) -> PhasedMotion {
    PhasedMotion::new(core::array::from_fn(|j| {
        let acceleration_max = limits.acceleration_max_rad_s2[j];
        brake_axis(AxisState::of(from, j), acceleration_max, jerk_max(j))
    }))
}

/// The joint (0-based) and the end (rad) of its range that even the hardest
/// brake from `from` would pass, if there is one. RT-safe.
///
/// A setpoint is only sent when the arm can still stop after it; so the brake
/// never has to leave a joint's range.
#[must_use]
pub fn unstoppable(from: &JointState, limits: &Limits) -> Option<(usize, f64, f64)> {
    let hardest = 1.0 / limits.period_s();
    (0..JOINTS).find_map(|j| {
        let start = AxisState::of(from, j);
        let (low, high) = (limits.position_min_rad[j], limits.position_max_rad[j]);
        let acceleration = limits.acceleration_max_rad_s2[j];
        let passes = |jerk: f64| {
            let (least, most) = brake_axis(start, acceleration, jerk).range();
            if most > high + ROUNDING_RAD {
                Some((j, most, high))
            } else if least < low - ROUNDING_RAD {
                Some((j, least, low))
            } else {
                None
            }
        };
        passes(limits.jerk_max_rad_s3[j]).and_then(|_| passes(acceleration * hardest))
    })
}

/// What is wrong with the motion in `at`, if even the hardest brake from there
/// breaks the speed or acceleration limit of a joint. RT-safe.
///
/// Differences of setpoints are means, so they show an excess only after the
/// motion itself has it; then no brake could begin within the limits.
#[must_use]
pub fn too_fast(at: &JointState, limits: &Limits) -> Option<Violation> {
    let hardest = 1.0 / limits.period_s();
    (0..JOINTS).find_map(|j| {
        let (speed_max, most) = (
            limits.velocity_max_rad_s[j],
            limits.acceleration_max_rad_s2[j],
        );
        let (qd, qdd) = (at.qd[j], at.qdd[j]);
        // Taking the acceleration away changes the speed once more.
        let peak = qd + qdd * qdd.abs() / (2.0 * most * hardest);
        let speed = qd.abs().max(peak.abs());
        let slack = 1.0 + ROUNDING_RAD;
        if speed > speed_max * slack + ROUNDING_RAD {
            let fault = FaultCode::SetpointVelocity;
            Some(Violation::of_joint(fault, j, speed, speed_max))
        } else if qdd.abs() > most * slack + ROUNDING_RAD {
            let fault = FaultCode::SetpointAcceleration;
            Some(Violation::of_joint(fault, j, qdd, most))
        } else {
            None
        }
    })
}

/// Rounding of positions (rad).
const ROUNDING_RAD: f64 = 1e-9;

/// Fastest way to rest of one joint.
///
/// Taking the acceleration away at full jerk changes the velocity by
/// `a|a|/(2J)`; what remains tells which way to push. In that direction, with
/// `w` the velocity to gain, the triangle of peak `p` gains
/// `(p² - a²)/(2J) + p²/(2J)`; when its peak passes the limit it becomes a
/// trapezoid.
fn brake_axis(start: AxisState, acceleration_max: f64, jerk_max: f64) -> AxisPhases {
    let remaining = start.qd + start.qdd * start.qdd.abs() / (2.0 * jerk_max);
    let push = if remaining > 0.0 { -1.0 } else { 1.0 };
    let (a, gain) = (push * start.qdd, -push * start.qd);
    let limit = acceleration_max.max(a.abs());
    let triangle = exact::sqrt((jerk_max * gain + a * a / 2.0).max(0.0));
    let peak = triangle.min(limit);
    let hold_s = if triangle > limit {
        (gain - (2.0 * limit * limit - a * a) / (2.0 * jerk_max)) / limit
    } else {
        0.0
    };
    let mut phases = [Phase::default(); MAX_PHASES];
    let ramps = [
        ((peak - a) / jerk_max, push * jerk_max),
        (hold_s, 0.0),
        (peak / jerk_max, -push * jerk_max),
    ];
    for (phase, (duration_s, jerk_rad_s3)) in phases.iter_mut().zip(ramps) {
        *phase = Phase {
            duration_s: duration_s.max(0.0),
            jerk_rad_s3,
        };
    }
    AxisPhases::new(start, phases)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;
    use proptest::prelude::*;

    fn brake(from: &JointState, limits: &Limits) -> PhasedMotion {
        brake_with_jerk(from, limits, |j| limits.jerk_max_rad_s3[j])
    }

    proptest! {
        #[test]
        fn ends_at_rest_within_acceleration_and_jerk(
            qd in -3.1_f64..3.1, qdd in -20.0_f64..20.0, q in -6.0_f64..6.0,
        ) {
            let limits = Limits::default();
            let from = JointState {
                q: JointVector::splat(q),
                qd: JointVector::splat(qd),
                qdd: JointVector::splat(qdd),
            };
            let motion = brake(&from, &limits);
            prop_assert!((motion.state_at(0.0).q[2] - q).abs() < 1e-12);
            // Longest possible: turn the acceleration round, then shed the speed.
            prop_assert!(motion.duration_s() < 0.08 + 3.5 / 20.0 + 0.16);
            let h = 1e-4;
            let mut before = motion.state_at(0.0);
            let mut t = h;
            while t < motion.duration_s() + 0.01 {
                let now = motion.state_at(t);
                prop_assert!(now.qdd.max_abs() <= 20.0 * (1.0 + 1e-9));
                prop_assert!((now.qdd - before.qdd).max_abs() <= 500.0 * h * (1.0 + 1e-6) + 1e-9);
                let mean = (now.qd + before.qd) * 0.5;
                prop_assert!((now.q - before.q - mean * h).max_abs() < 1e-9);
                before = now;
                t += h;
            }
            // The states just before the end meet those at rest.
            let last = motion.state_at(motion.duration_s() - 1e-9);
            prop_assert!(last.qd.max_abs() < 1e-6 && last.qdd.max_abs() < 1e-5);
            prop_assert!((last.q - motion.state_at(10.0).q).max_abs() < 1e-7);
        }
    }

    #[test]
    fn a_resting_arm_stays() {
        let at = JointState::at_rest(JointVector::splat(0.5));
        let motion = brake(&at, &Limits::default());
        assert_eq!(motion.duration_s(), 0.0);
        assert_eq!(motion.state_at(0.004), at);
    }

    /// From 1 rad/s with 20 rad/s² and 500 rad/s³: 0.04 s to build the
    /// deceleration up, 0.01 s of it, 0.04 s to let go; symmetric, so half the
    /// speed on average.
    #[test]
    fn known_brake() {
        let from = JointState {
            qd: JointVector::splat(1.0),
            ..JointState::default()
        };
        let motion = brake(&from, &Limits::default());
        assert!((motion.duration_s() - 0.09).abs() < 1e-12);
        assert!((motion.state_at(1.0).q[0] - 0.045).abs() < 1e-12);
    }
}
