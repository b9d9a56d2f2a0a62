//! Where the joints go when velocities are sent.
//!
//! By positions the setpoints are the motion. By velocities they are not: the arm goes
//! from one velocity to the next with an acceleration and a jerk of its own, falls behind
//! where the plan turns hard, and the controller's position loop brings it back. The plan
//! is run here against that, cycle by cycle, with the controller's own position loop.

use super::rules::Step;
use arm_model::{JOINTS, JointState, JointTrajectory, JointVector, Limits};
use control_core::control::brake::brake_with_jerk;
use control_core::control::velocity_interface::VelocityInterface;
use control_core::control::{ArmCommand, Thresholds};
use std::collections::VecDeque;

/// Jerk with which the arm changes its velocity (rad/s³): the vendor's largest, which
/// clients cannot change in this mode.
const JERK_RAD_S3: f64 = 500.0;
/// How late an arm shows what its firmware asks of the joints, in cycles: dead time and
/// lag of a typical one, 20 ms.
const SHOWN_LATE: usize = 5;
/// How old the newest report is when the controller looks at it, in cycles: those of port
/// 30003 come every 10 ms.
const REPORTED_LATE: usize = 2;
/// How long the motion is watched after the end of the plan (s).
const SETTLE_S: f64 = 0.3;

/// One cycle of the arm's way from velocity to velocity, towards `qd` (rad/s). Seen from
/// there it is a brake to rest.
fn ramp(state: &JointState, qd: &JointVector, limits: &Limits) -> JointState {
    let period_s = limits.period_s();
    let seen = JointState {
        qd: state.qd - *qd,
        ..*state
    };
    let after = brake_with_jerk(&seen, limits, |_| JERK_RAD_S3).state_at(period_s);
    JointState {
        q: after.q + *qd * period_s,
        qd: after.qd + *qd,
        qdd: after.qdd,
    }
}

/// The motion of a plan that is sent as velocities, by time since its beginning (s): where the
/// plan is, where the firmware has brought the joints, and how far these, as they are
/// reported, are outside all that was planned within the controller's window.
pub(super) fn steps(trajectory: &JointTrajectory, limits: &Limits) -> Vec<(f64, Step)> {
    let period_s = limits.period_s();
    let window = window_cycles(period_s);
    let count = ((trajectory.duration_s() + SETTLE_S) / period_s).ceil() as u32;
    let start = trajectory.start();
    let mut arm = JointState::at_rest(start);
    let mut interface = VelocityInterface::default();
    // Newest last: what was planned, and what the firmware asked for.
    let mut planned = VecDeque::from(vec![start; window]);
    let mut requested = VecDeque::from(vec![start; SHOWN_LATE]);
    let mut off = VecDeque::from(vec![JointVector::ZERO; REPORTED_LATE]);
    let mut out = Vec::with_capacity(count as usize + 1);
    for k in 0..=count {
        let time_s = f64::from(k) * period_s;
        let target = trajectory.state_at(time_s);
        let shown = requested.pop_front().unwrap_or(start);
        planned.push_back(target.q);
        let step = Step {
            q: arm.q,
            deviation_rad: outside_rad(&shown, &planned),
            ..Step::at(target.q)
        };
        out.push((time_s, step));
        planned.pop_front();
        requested.push_back(arm.q);
        off.push_back(target.q - shown);
        let reported = off.pop_front().unwrap_or_default();
        let speed_max = limits.tcp_speed_max_m_s;
        let command = interface.command(&target, &reported, period_s, limits, speed_max);
        if let ArmCommand::Velocity { qd, .. } = command {
            arm = ramp(&arm, &qd, limits);
        }
    }
    out
}

/// How many cycles the controller remembers what it asked for.
fn window_cycles(period_s: f64) -> usize {
    (1e-9 * Thresholds::strict().tracking_window_ns as f64 / period_s).round() as usize
}

/// How far a pose lies outside all of those, in its worst joint (rad).
fn outside_rad(q: &JointVector, poses: &VecDeque<JointVector>) -> f64 {
    (0..JOINTS)
        .map(|j| {
            let of = || poses.iter().map(|p| p[j]);
            let low = of().fold(f64::INFINITY, f64::min);
            let high = of().fold(f64::NEG_INFINITY, f64::max);
            (low - q[j]).max(q[j] - high)
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    fn swing(by_rad: f64, in_s: f64) -> JointTrajectory {
        let mut end = START_POSE;
        end[6] += by_rad;
        JointTrajectory::new(&[0.0, in_s], &[START_POSE, end]).unwrap()
    }

    /// A velocity ramp of acceleration `a` and jerk `J` is `a / J` late at the least: 40 ms
    /// where it begins and ends at the full acceleration.
    #[test]
    fn a_gentle_plan_is_followed_and_a_hard_one_less_well() {
        let limits = Limits::default();
        let gentle = steps(&swing(0.5, 2.0), &limits);
        let off = |(_, step): &(f64, Step)| (step.setpoint - step.q).max_abs();
        let worst = |steps: &[(f64, Step)]| steps.iter().map(off).fold(0.0, f64::max);
        assert!(worst(&gentle) < 0.02, "{}", worst(&gentle));
        assert!(gentle.iter().all(|(_, step)| step.deviation_rad < 0.005));
        assert!(off(gentle.last().unwrap()) < 0.005);
        let hard = steps(&swing(0.8, 0.5), &limits);
        assert!(worst(&hard) > 2.0 * worst(&gentle), "{}", worst(&hard));
    }

    /// Velocity and acceleration of the firmware's reference stay within its own limits.
    #[test]
    fn ramps_keep_acceleration_and_jerk() {
        let limits = Limits::default();
        let mut arm = JointState::at_rest(START_POSE);
        let mut way_rad = 0.0;
        for k in 0..400_u32 {
            let before = arm;
            let wanted = if k < 200 { 3.0 } else { -1.0 };
            arm = ramp(&arm, &JointVector::splat(wanted), &limits);
            let jerk = (arm.qdd - before.qdd).max_abs() / limits.period_s();
            assert!(arm.qdd.max_abs() <= 20.0 + 1e-9);
            assert!(jerk <= JERK_RAD_S3 * (1.0 + 1e-9), "{jerk}");
            way_rad += 0.5 * (arm.qd[0] + before.qd[0]) * limits.period_s();
        }
        assert!((arm.qd[0] + 1.0).abs() < 1e-9);
        assert!((arm.q[0] - START_POSE[0] - way_rad).abs() < 1e-3);
    }
}
