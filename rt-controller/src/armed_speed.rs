//! How fast a motion may be for what it is armed for: the tool centre point, by which the loop
//! would brake it on its way, and the pole's end, which moves faster and is what hits somebody.

use crate::control::{Motion, OperatingModeSpeeds};
use crate::point_to_point::{MoveError, plan_move};
use arm_model::kinematics::tool_speed_m_s;
use arm_model::{JointVector, Limits, LimitsSpec, Pole};
use shared_types::{FaultCode, OperatingMode};

/// Largest speed of the pole's end in a set-up motion (m/s): ISO 10218-1's reduced speed.
const SET_UP_POLE_M_S: f64 = 0.25;
/// The same of a wiggle (m/s). That of the paper reaches 0.72.
const WIGGLE_POLE_M_S: f64 = 1.0;
/// What the loop judges by, differences over a cycle, may be this part less than the speed.
const SPEED_ROUNDING: f64 = 1e-3;
/// Moves planned until one is slow enough, each at this part of the speed of the one before.
const ATTEMPTS: usize = 10;
const SLOWER: f64 = 0.7;

/// Largest speed of the pole's end (m/s); only the limits bound that of a throw.
const fn pole_speed_max_m_s(armed: OperatingMode) -> f64 {
    match armed {
        OperatingMode::SetUp => SET_UP_POLE_M_S,
        OperatingMode::Wiggle => WIGGLE_POLE_M_S,
        OperatingMode::Throw => f64::INFINITY,
    }
}

/// What a motion is armed for, and how fast that lets it be.
#[derive(Debug, Clone, Copy)]
pub struct ArmedSpeed<'a> {
    /// What the arm is armed for.
    pub armed: OperatingMode,
    /// Limits of the arm.
    pub limits: &'a Limits,
    /// The pole it carries.
    pub pole: &'a Pole,
    /// Tool speeds of the operating modes.
    pub speeds: OperatingModeSpeeds,
}

impl ArmedSpeed<'_> {
    /// Refuses a motion that is faster than it is armed for.
    ///
    /// # Errors
    /// Which point is too fast, when, and what is allowed.
    pub fn check(&self, motion: &Motion) -> Result<(), String> {
        let armed = match motion {
            // The controller's own moves never go faster than a wiggle.
            Motion::Move { .. } => self.armed.min(OperatingMode::Wiggle),
            Motion::Spline(_) => self.armed,
        };
        let tool_m_s = self.speeds.of(armed, self.limits.tcp_speed_max_m_s);
        let period_s = self.limits.period_s();
        let cycles = (motion.duration_s() / period_s).ceil() as u32;
        for (point, offset_m, most_m_s) in [
            ("tool", self.limits.tcp_offset(), tool_m_s),
            ("pole's end", self.pole.end_m(), pole_speed_max_m_s(armed)),
        ] {
            let speed = |cycle: u32| {
                let t_s = f64::from(cycle) * period_s;
                let state = motion.state_at(t_s);
                (tool_speed_m_s(&state.q, &state.qd, &offset_m), t_s)
            };
            let fastest = (0..=cycles).map(speed).max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((top_m_s, at_s)) = fastest
                && top_m_s > most_m_s * (1.0 + SPEED_ROUNDING)
            {
                return Err(format!(
                    "the {point} would reach {top_m_s:.3} m/s after {at_s:.2} s, armed for {:?} it may move at {most_m_s:.3}: move more slowly, or arm for more",
                    self.armed
                ));
            }
        }
        Ok(())
    }

    /// A move from `from` to `to` (rad), as fast as asked for (part of what the limits allow) or
    /// as it is armed for.
    ///
    /// # Errors
    /// The move breaks a limit, or cannot be slow enough.
    pub fn plan_move(
        &self,
        from: &JointVector,
        to: &JointVector,
        speed_fraction: f64,
    ) -> Result<Motion, (FaultCode, String)> {
        let refused = |error: MoveError| (error.fault, error.to_string());
        // Mostly the pole's end is the faster point: the plan is slowed down by it.
        let mut spec = LimitsSpec::from(self.limits.clone());
        spec.tcp_offset_m = self.pole.end_m().into();
        let most_m_s = pole_speed_max_m_s(self.armed.min(OperatingMode::Wiggle));
        spec.tcp_speed_max_m_s = spec.tcp_speed_max_m_s.min(most_m_s);
        let slow = Limits::try_from(spec)
            .map_err(|reason| (FaultCode::PlanOutOfLimits, format!("pole: {reason}")))?;
        let mut motion = plan_move(from, to, speed_fraction, &slow).map_err(refused)?;
        let mut fraction = speed_fraction;
        for _ in 0..ATTEMPTS {
            if self.check(&motion).is_ok() {
                break;
            }
            fraction *= SLOWER;
            motion = plan_move(from, to, fraction, &slow).map_err(refused)?;
        }
        let kept = self.check(&motion);
        kept.map_err(|detail| (FaultCode::OperatingModeExceeded, detail))?;
        Ok(motion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    /// Speed of the fastest point of a move (m/s).
    fn top_m_s(motion: &Motion, offset_m: &nalgebra::Vector3<f64>) -> f64 {
        let speed = |k: u32| {
            let state = motion.state_at(f64::from(k) * 1e-3);
            tool_speed_m_s(&state.q, &state.qd, offset_m)
        };
        let samples = (motion.duration_s() * 1e3) as u32;
        (0..samples).map(speed).fold(0.0, f64::max)
    }

    #[test]
    fn a_move_is_as_fast_as_it_is_armed_for_at_most() {
        let (limits, pole) = (Limits::default(), Pole::default());
        for armed in [
            OperatingMode::SetUp,
            OperatingMode::Wiggle,
            OperatingMode::Throw,
        ] {
            // About joint 1 flange and pole's end are equally fast, about joint 6 they are not.
            for joint in [0, 5] {
                let mut to = START_POSE;
                to[joint] += 1.0;
                let speed = ArmedSpeed {
                    armed,
                    limits: &limits,
                    pole: &pole,
                    speeds: OperatingModeSpeeds::default(),
                };
                let motion = speed.plan_move(&START_POSE, &to, 1.0).unwrap();
                let flange_m_s = top_m_s(&motion, &limits.tcp_offset());
                let end_m_s = top_m_s(&motion, &pole.end_m());
                let most = if armed == OperatingMode::SetUp {
                    [0.25, 0.25]
                } else {
                    [0.5, 1.0]
                };
                let used = (flange_m_s / most[0]).max(end_m_s / most[1]);
                assert!(
                    (0.5..1.005).contains(&used),
                    "{armed:?}, joint {joint}: {flange_m_s} {end_m_s}"
                );
            }
        }
    }
}
