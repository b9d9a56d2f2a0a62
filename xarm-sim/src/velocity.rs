//! Joint velocity commands: towards a velocity with the firmware's own jerk and
//! acceleration.

use arm_model::{JOINTS, JointVector, Limits};
use shared_types::MonotonicNs;

/// Jerk of velocity commands, fixed in the firmware (rad/s³). The vendor's
/// largest joint jerk; clients cannot change it.
const JERK_RAD_S3: f64 = 500.0;
/// Smallest part of jerk and acceleration that a synchronised joint gets.
const SMALLEST_SHARE: f64 = 1e-3;

/// A velocity to reach and keep until its time is over.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VelocityRamp {
    target: JointVector,
    synchronised: bool,
    until: Option<MonotonicNs>,
    /// Part of jerk and acceleration that each joint uses.
    share: JointVector,
}

impl VelocityRamp {
    /// Towards `target` (rad/s), back to rest at `until`. Joints that are not
    /// accelerating yet reach a synchronised target at the same time.
    pub(super) fn new(
        target: JointVector,
        synchronised: bool,
        until: Option<MonotonicNs>,
        qd: JointVector,
        qdd: JointVector,
    ) -> Self {
        let change = (target - qd).map(f64::abs);
        let most = change.max_abs();
        let share = if synchronised && most > 0.0 && qdd.max_abs() < 1e-9 {
            change.map(|c| (c / most).max(SMALLEST_SHARE))
        } else {
            JointVector::splat(1.0)
        };
        Self {
            target,
            synchronised,
            until,
            share,
        }
    }

    /// One step of `dt_s` ending at `now`; whether all joints rest for good.
    pub(super) fn advance(
        &mut self,
        now: MonotonicNs,
        dt_s: f64,
        limits: &Limits,
        [q, qd, qdd]: [&mut JointVector; 3],
    ) -> bool {
        if self.until.is_some_and(|until| now >= until) {
            *self = Self::new(JointVector::ZERO, self.synchronised, None, *qd, *qdd);
        }
        for j in 0..JOINTS {
            let jerk = JERK_RAD_S3 * self.share[j];
            let most = limits.acceleration_max_rad_s2[j] * self.share[j];
            let missing = self.target[j] - qd[j];
            let step = jerk * dt_s;
            if missing.abs() <= step * dt_s && qdd[j].abs() <= 1.5 * step {
                (qd[j], qdd[j]) = (self.target[j], 0.0);
            } else {
                // From this acceleration, falling by one step per step, the
                // rest of the way is just covered.
                let half = 0.5 * step;
                let reach = (2.0 * jerk * missing.abs() + half * half).sqrt() - half;
                let wanted = missing.signum() * reach.min(most);
                qdd[j] += (wanted - qdd[j]).clamp(-step, step);
                qd[j] += qdd[j] * dt_s;
            }
            q[j] += qd[j] * dt_s;
        }
        self.target.max_abs() == 0.0 && qd.max_abs() == 0.0 && qdd.max_abs() == 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 1e-3;

    /// Runs from rest towards `target` until `done` with the speed; that speed, and the
    /// time it took (s).
    fn run(target: JointVector, done: impl Fn(&JointVector) -> bool) -> (JointVector, f64) {
        let limits = Limits::default();
        let [mut q, mut qd, mut qdd] = [JointVector::ZERO; 3];
        let mut ramp = VelocityRamp::new(target, true, None, qd, qdd);
        let mut took_s = 0.0;
        while !done(&qd) {
            assert!(took_s < 10.0, "never done");
            took_s += DT_S;
            let (now, before) = (MonotonicNs(0).plus_s(took_s), qdd);
            ramp.advance(now, DT_S, &limits, [&mut q, &mut qd, &mut qdd]);
            assert!(qdd.max_abs() <= 20.0 + 1e-9);
            // Twice the jerk in the one step that lands on the target.
            assert!((qdd - before).max_abs() <= 2.0 * JERK_RAD_S3 * DT_S);
        }
        (qd, took_s)
    }

    /// From rest to `v` with jerk `J` below the acceleration limit takes
    /// `2 sqrt(v / J)`; above it `v / A + A / J`.
    #[test]
    fn ramps_take_the_time_of_a_jerk_limited_profile() {
        for (v, want_s) in [(0.5, 2.0 * (0.5_f64 / 500.0).sqrt()), (3.0, 0.15 + 0.04)] {
            let (_, took_s) = run(JointVector::splat(v), |qd| qd[0] == v);
            assert!((took_s - want_s).abs() < 0.005, "{v}: {took_s} s");
        }
    }

    #[test]
    fn synchronised_joints_arrive_together() {
        let target = JointVector([2.0, 0.0, 0.0, -0.7, 0.0, 0.0, 0.1]);
        let (qd, _) = run(target, |qd| (qd[0] - 1.0).abs() < 0.02);
        let part = qd[0] / target[0];
        for j in [3, 6] {
            assert!((qd[j] / target[j] - part).abs() < 0.01, "joint {j}");
        }
    }
}
