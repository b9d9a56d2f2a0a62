//! Joint velocities for the wire: the path's own, and what closes the position
//! loop, because positions drift when only velocities are sent.
//!
//! `qd = feed-forward + K (commanded - measured)`, the commanded joints taken at
//! the time of the measurement. The result keeps the limits of joints and tool
//! and changes no faster than the acceleration limit: all joints move towards
//! what is wanted by the same part, so that a limited command still points the
//! right way.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of float vectors only, which cannot overflow or panic"
)]

use super::exchange::ArmCommand;
use arm_model::{JOINTS, JointState, JointVector, Limits, kinematics};
use serde::{Deserialize, Serialize};

/// Gain of the position loop (1/s): slow beside the arm's own response, so that
/// its lag cannot make the loop swing.
pub const GAIN_PER_S: f64 = 4.0;
/// Most that the position loop may add (rad/s).
pub const CORRECTION_MAX_RAD_S: f64 = 0.2;
/// Part of the speed limit that is used: the wire's 32-bit floats may round up.
const OF_LIMIT: f64 = 1.0 - 1e-6;
/// The arm stops by itself after this many cycles without a new command.
pub const DURATION_CYCLES: f64 = 3.0;

/// The velocity sent last. RT-safe.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct VelocityInterface {
    qd: JointVector,
}

impl VelocityInterface {
    /// Velocity sent last (rad/s).
    #[must_use]
    pub const fn newest(&self) -> JointVector {
        self.qd
    }

    /// The command for `target`, `step_s` after the last one. `off` is the
    /// commanded less the measured position at one instant (rad). RT-safe.
    pub fn command(
        &mut self,
        target: &JointState,
        off: &JointVector,
        step_s: f64,
        limits: &Limits,
        tcp_speed_max_m_s: f64,
    ) -> ArmCommand {
        let period_s = limits.period_s();
        // The velocity holds for a cycle, so it is that of the cycle's middle.
        let ahead = target.qdd * (period_s / 2.0);
        let mut wanted = JointVector::ZERO;
        for j in 0..JOINTS {
            let off_rad = if off[j].is_finite() { off[j] } else { 0.0 };
            let back = (GAIN_PER_S * off_rad).clamp(-CORRECTION_MAX_RAD_S, CORRECTION_MAX_RAD_S);
            let most = limits.velocity_max_rad_s[j] * OF_LIMIT;
            wanted[j] = (target.qd[j] + ahead[j] + back).clamp(-most, most);
        }
        let speed_m_s = kinematics::tool_speed_m_s(&target.q, &wanted, &limits.tcp_offset());
        if speed_m_s > tcp_speed_max_m_s {
            wanted = wanted * (tcp_speed_max_m_s / speed_m_s);
        }
        let change = wanted - self.qd;
        let span_s = step_s.clamp(0.0, DURATION_CYCLES * period_s);
        let part = (0..JOINTS).fold(1.0_f64, |part, j| {
            let most = limits.acceleration_max_rad_s2[j] * span_s;
            if change[j].abs() > most {
                part.min(most / change[j].abs())
            } else {
                part
            }
        });
        self.qd = self.qd + change * part;
        ArmCommand::Velocity {
            qd: self.qd,
            duration_s: DURATION_CYCLES * period_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;
    use rand::{RngExt, SeedableRng};

    fn velocity(command: ArmCommand) -> JointVector {
        match command {
            ArmCommand::Velocity { qd, duration_s } => {
                assert!((duration_s - 0.012).abs() < 1e-12);
                qd
            }
            ArmCommand::Position(_) => panic!("a position in velocity mode"),
        }
    }

    #[test]
    fn whatever_is_wanted_stays_in_limits() {
        let limits = Limits::default();
        let mut interface = VelocityInterface::default();
        let mut before = JointVector::ZERO;
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for k in 0..20_000 {
            let mut any = || JointVector([0.0; 7].map(|_| rng.random_range(-9.0..9.0)));
            let target = JointState {
                q: START_POSE,
                qd: any(),
                qdd: any() * 3.0,
            };
            let mut off = any();
            if k % 7 == 0 {
                off[3] = f64::NAN;
            }
            let qd = velocity(interface.command(&target, &off, 0.004, &limits, 1.2));
            assert!(qd.max_abs() <= limits.velocity_max_rad_s[0] * (1.0 + 1e-9));
            assert!((qd - before).max_abs() <= 20.0 * 0.004 * (1.0 + 1e-9));
            let speed = kinematics::tool_speed_m_s(&START_POSE, &qd, &limits.tcp_offset());
            assert!(speed <= 1.2 * (1.0 + 1e-9), "{speed}");
            before = qd;
        }
    }

    /// An arm that moves exactly as told but started 10 mrad off comes back.
    #[test]
    fn an_offset_is_worked_off() {
        let limits = Limits::default();
        let mut interface = VelocityInterface::default();
        let target = JointState::at_rest(START_POSE);
        let mut off = JointVector::splat(0.01);
        for _ in 0..500 {
            let qd = velocity(interface.command(&target, &off, 0.004, &limits, 1.2));
            off = off - qd * 0.004;
        }
        assert!(off.max_abs() < 1e-4, "{off:?}");
    }
}
