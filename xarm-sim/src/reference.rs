//! What the controller asks of its joints, one millisecond after the other.
//!
//! Streamed setpoints jump (the controller does not interpolate them); moves,
//! velocity commands and stops are made here.

use super::velocity::VelocityRamp;
use arm_model::{JOINTS, JointVector, Limits};
use rt_controller::xarm::Register;
use shared_types::MonotonicNs;

/// A straight joint motion with a trapezoidal speed of its fastest joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Move {
    pub(super) target: JointVector,
    pub(super) speed_rad_s: f64,
    pub(super) acceleration_rad_s2: f64,
    /// Who is told about its start and end.
    pub(super) task: Task,
}

/// Where a move came from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Task {
    /// Client and transaction id of the request, `None` for the arm's own.
    pub(super) origin: Option<(u32, u16)>,
    pub(super) register: Register,
    pub(super) number: u16,
}

#[derive(Debug, Clone, Copy)]
enum Profile {
    /// The reference stays, or jumps with streamed setpoints.
    Hold,
    /// Along `direction` (largest entry 1), `left_rad` from the target.
    Line {
        target: JointVector,
        direction: JointVector,
        left_rad: f64,
        speed_rad_s: f64,
        speed_max_rad_s: f64,
        acceleration_rad_s2: f64,
    },
    /// Towards a joint velocity.
    Velocity(VelocityRamp),
    /// To rest, all joints at the same time.
    Brake {
        rate_per_s: f64,
        start: JointVector,
        left: f64,
    },
}

/// Reference position and velocity of the joints.
#[derive(Debug, Clone)]
pub(super) struct Reference {
    /// Position (rad).
    pub(super) q: JointVector,
    /// Velocity (rad/s).
    pub(super) qd: JointVector,
    /// Acceleration (rad/s²), zero for streamed setpoints.
    pub(super) qdd: JointVector,
    profile: Profile,
}

impl Reference {
    pub(super) fn at_rest(q: JointVector) -> Self {
        Self {
            q,
            qd: JointVector::ZERO,
            qdd: JointVector::ZERO,
            profile: Profile::Hold,
        }
    }

    /// Whether a profile is being run.
    pub(super) fn is_busy(&self) -> bool {
        !matches!(self.profile, Profile::Hold)
    }

    /// Jumps to a streamed setpoint (rad), `qd` (rad/s) being its speed.
    pub(super) fn jump(&mut self, q: JointVector, qd: JointVector) {
        *self = Self {
            q,
            qd,
            ..Self::at_rest(q)
        };
    }

    /// The stream has fallen silent: the last setpoint is held.
    pub(super) fn hold(&mut self) {
        *self = Self::at_rest(self.q);
    }

    /// Starts a move from rest.
    pub(super) fn start_move(&mut self, motion: &Move) {
        let way = motion.target - self.q;
        let length_rad = way.max_abs();
        if length_rad < 1e-9 {
            return self.hold();
        }
        self.profile = Profile::Line {
            target: motion.target,
            direction: way * (1.0 / length_rad),
            left_rad: length_rad,
            speed_rad_s: 0.0,
            speed_max_rad_s: motion.speed_rad_s,
            acceleration_rad_s2: motion.acceleration_rad_s2,
        };
    }

    /// Goes over to a joint velocity (rad/s), and to rest at `until`.
    pub(super) fn start_velocity(
        &mut self,
        target: JointVector,
        synchronised: bool,
        until: Option<MonotonicNs>,
    ) {
        let ramp = VelocityRamp::new(target, synchronised, until, self.qd, self.qdd);
        self.profile = Profile::Velocity(ramp);
    }

    /// Brakes to rest, the fastest joint at `deceleration_rad_s2`.
    pub(super) fn brake(&mut self, deceleration_rad_s2: f64) {
        let speed = self.qd.max_abs();
        if speed < 1e-6 {
            return self.hold();
        }
        self.profile = Profile::Brake {
            rate_per_s: deceleration_rad_s2 / speed,
            start: self.qd,
            left: 1.0,
        };
    }

    /// One step of `dt_s` ending at `now`.
    pub(super) fn advance(&mut self, now: MonotonicNs, dt_s: f64, limits: &Limits) {
        let before = self.qd;
        match &mut self.profile {
            Profile::Hold => return,
            Profile::Velocity(ramp) => {
                let motion = [&mut self.q, &mut self.qd, &mut self.qdd];
                if ramp.advance(now, dt_s, limits, motion) {
                    self.hold();
                }
                return;
            }
            Profile::Line {
                target,
                direction,
                left_rad,
                speed_rad_s,
                speed_max_rad_s,
                acceleration_rad_s2,
            } => {
                let can_stop_from = (2.0 * *acceleration_rad_s2 * *left_rad).sqrt();
                *speed_rad_s = (*speed_rad_s + *acceleration_rad_s2 * dt_s)
                    .min(*speed_max_rad_s)
                    .min(can_stop_from);
                *left_rad -= *speed_rad_s * dt_s;
                if *left_rad <= 1e-6 {
                    return *self = Self::at_rest(*target);
                }
                self.q = *target - *direction * *left_rad;
                self.qd = *direction * *speed_rad_s;
            }
            Profile::Brake {
                rate_per_s,
                start,
                left,
            } => {
                let next = (*left - *rate_per_s * dt_s).max(0.0);
                for j in 0..JOINTS {
                    // A joint that meets the end of its range stops there.
                    let (min, max) = (limits.position_min_rad[j], limits.position_max_rad[j]);
                    let free = self.q[j] + start[j] * (0.5 * (*left + next) * dt_s);
                    self.q[j] = free.clamp(min, max);
                }
                if next == 0.0 {
                    return self.hold();
                }
                self.qd = *start * next;
                *left = next;
            }
        }
        self.qdd = (self.qd - before) * (1.0 / dt_s);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 1e-3;

    fn run(reference: &mut Reference) -> (f64, f64) {
        let limits = Limits::default();
        let (mut time_s, mut peak) = (0.0, 0.0_f64);
        while reference.is_busy() && time_s < 60.0 {
            time_s += DT_S;
            reference.advance(MonotonicNs(0).plus_s(time_s), DT_S, &limits);
            peak = peak.max(reference.qd.max_abs());
        }
        (time_s, peak)
    }

    /// A trapezoid over `d` at speed `v` and acceleration `a` takes `d/v + v/a`.
    #[test]
    fn move_takes_the_time_of_a_trapezoid() {
        let mut reference = Reference::at_rest(JointVector::ZERO);
        let mut target = JointVector::ZERO;
        (target[0], target[6]) = (-1.0, 0.5);
        reference.start_move(&Move {
            target,
            speed_rad_s: 0.5,
            acceleration_rad_s2: 5.0,
            task: Task {
                origin: None,
                register: Register::MoveJoint,
                number: 1,
            },
        });
        let (time_s, peak) = run(&mut reference);
        assert!((time_s - 2.1).abs() < 0.01, "{time_s}");
        assert!((peak - 0.5).abs() < 1e-9);
        assert_eq!(reference.q, target);
    }

    /// Braking from `v` at `a` covers `v² / 2a`.
    #[test]
    fn brake_covers_the_stopping_distance() {
        let mut reference = Reference::at_rest(JointVector::ZERO);
        let mut qd = JointVector::ZERO;
        (qd[1], qd[3]) = (2.0, -1.0);
        reference.jump(JointVector::ZERO, qd);
        reference.brake(20.0);
        let (time_s, _) = run(&mut reference);
        assert!((time_s - 0.1).abs() < 2.0 * DT_S, "{time_s}");
        assert!((reference.q[1] - 0.1).abs() < 1e-6 && (reference.q[3] + 0.05).abs() < 1e-6);
    }
}
