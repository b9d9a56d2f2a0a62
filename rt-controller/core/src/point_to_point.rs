//! Moves from pose to pose, planned before they begin.
//!
//! A time-optimal jerk-limited profile per joint, synchronised (Ruckig,
//! arXiv:2105.04830), slowed down until the tool speed holds too, and then
//! checked point by point with the very limiter that guards the wire. What the
//! generator says is never trusted: a profile that fails any check is an error
//! here and never reaches the arm.

use crate::control::Motion;
use crate::control::brake::unstoppable;
use crate::control::limiter::{Allowance, Limiter};
use crate::control::phases::{AxisPhases, AxisState, MAX_PHASES, Phase, PhasedMotion};
use alloc::format;
use alloc::string::{String, ToString};
use arm_model::{JOINTS, JointVector, Limits};
use rsruckig::prelude::*;
use shared_types::FaultCode;

/// Speed is reduced by this factor until the tool speed holds.
const SLOWER: f64 = 0.85;
/// Attempts; the last one is at a hundredth of the speed.
const ATTEMPTS: u32 = 30;

/// Why a move cannot be planned: the fault code nearest to it, and what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{message}")]
pub struct MoveError {
    /// The fault code.
    pub fault: FaultCode,
    message: String,
}

impl MoveError {
    const fn new(fault: FaultCode, message: String) -> Self {
        Self { fault, message }
    }
}

/// Plans a move that rests at `from` and at `to` (rad), `speed_fraction` (0 to 1] as
/// fast as the limits allow.
pub fn plan_move(
    from: &JointVector,
    to: &JointVector,
    speed_fraction: f64,
    limits: &Limits,
) -> Result<Motion, MoveError> {
    if !(speed_fraction > 0.0 && speed_fraction <= 1.0) {
        let message =
            format!("`speed_fraction` is {speed_fraction}, it must be above 0 and at most 1");
        return Err(MoveError::new(FaultCode::PlanOutOfLimits, message));
    }
    if let Some(j) = limits.position_violation(to) {
        let (joint, q_rad) = (j + 1, to[j]);
        let message = format!("joint {joint} of the target, {q_rad:.4} rad, is outside its range");
        return Err(MoveError::new(FaultCode::SetpointPosition, message));
    }
    let mut part = speed_fraction;
    let mut broken = FaultCode::SetpointTcpSpeed;
    for _ in 0..ATTEMPTS {
        let motion = generate(from, to, part, limits)?;
        match verify(&motion, limits) {
            Ok(()) => return Ok(motion),
            Err(fault) => broken = fault,
        }
        part *= SLOWER;
    }
    let message = format!("the move would break a limit: {}", broken.explain());
    Err(MoveError::new(broken, message))
}

/// The speed fraction at which a move lasts `duration_s`, but for what the limits allow at most.
///
/// # Errors
/// As [`plan_move`].
pub fn fraction_that_lasts(
    from: &JointVector,
    to: &JointVector,
    duration_s: f64,
    limits: &Limits,
) -> Result<f64, MoveError> {
    const LEAST: f64 = 1e-3;
    // Not slowed down for the tool's speed: time scales with the fraction, exactly.
    let fastest_s = generate(from, to, 1.0, limits)?.duration_s();
    Ok((fastest_s / duration_s).clamp(LEAST, 1.0))
}

/// Runs the motion through the limiter at the wire's rate.
///
/// # Errors
/// The limit it breaks.
pub fn verify(motion: &Motion, limits: &Limits) -> Result<(), FaultCode> {
    let period_s = limits.period_s();
    let mut limiter = Limiter::at_rest(motion.start(), limits);
    let allowed = Allowance {
        tcp_speed_max_m_s: limits.tcp_speed_max_m_s,
        streamed: matches!(motion, Motion::Spline(_)),
    };
    let mut t_s = 0.0;
    loop {
        let state = motion.state_at(t_s);
        limiter
            .admit(&state.q, period_s, limits, &allowed)
            .map_err(|found| found.fault)?;
        if unstoppable(&state, limits).is_some() {
            return Err(FaultCode::SetpointUnstoppable);
        }
        if t_s > motion.duration_s() + period_s {
            return Ok(());
        }
        t_s += period_s;
    }
}

fn generate(
    from: &JointVector,
    to: &JointVector,
    part: f64,
    limits: &Limits,
) -> Result<Motion, MoveError> {
    let mut input = InputParameter::<JOINTS>::new(None);
    for j in 0..JOINTS {
        input.current_position[j] = from[j];
        input.target_position[j] = to[j];
        // A hair below the limits: rounding must not touch them. Scaling the n-th
        // derivative by the n-th power slows the whole move down uniformly, so
        // that a gentle move is gentle from its first cycle on.
        let slack = 1.0 - 1e-9;
        input.max_velocity[j] = limits.velocity_max_rad_s[j] * slack * part;
        input.max_acceleration[j] = limits.acceleration_max_rad_s2[j] * slack * part * part;
        input.max_jerk[j] = limits.jerk_max_rad_s3[j] * slack * part * part * part;
    }
    let mut generator = Ruckig::<JOINTS, ThrowErrorHandler>::new(None, limits.period_s());
    let mut trajectory = Trajectory::<JOINTS>::new(None);
    let failed = |reason: String| {
        let message = format!("no jerk-limited move was found ({reason}); try another pose");
        MoveError::new(FaultCode::PlanOutOfLimits, message)
    };
    let result = generator
        .calculate(&input, &mut trajectory)
        .map_err(|e| failed(e.to_string()))?;
    if !matches!(result, RuckigResult::Working | RuckigResult::Finished) {
        return Err(failed(format!("{result:?}")));
    }
    let profiles = trajectory
        .profiles
        .first()
        .ok_or_else(|| failed(String::from("it is empty")))?;
    let axes = core::array::from_fn(|j| {
        let start = AxisState {
            q: from[j],
            ..AxisState::default()
        };
        let mut phases = [Phase::default(); MAX_PHASES];
        let parts = profiles
            .get(j)
            .map(|profile| profile.t.iter().zip(&profile.j));
        for (phase, (t, jerk)) in phases.iter_mut().zip(parts.into_iter().flatten()) {
            *phase = Phase {
                duration_s: *t,
                jerk_rad_s3: *jerk,
            };
        }
        AxisPhases::new(start, phases)
    });
    let phases = PhasedMotion::new(axes);
    let arrives = phases.state_at(phases.duration_s() + 1.0).q - *to;
    if !(arrives.is_finite() && arrives.max_abs() < 1e-9) {
        return Err(failed(String::from("it does not arrive at the target")));
    }
    Ok(Motion::Move { phases, end: *to })
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn any_two_poses_are_joined_within_limits(
            a in prop::array::uniform7(0.0_f64..1.0),
            b in prop::array::uniform7(0.0_f64..1.0),
            part in 0.05_f64..1.0,
        ) {
            let limits = Limits::default();
            let pose = |u: [f64; 7]| JointVector(u).zip_with(limits.position_min_rad, |u, lo| u + lo)
                .zip_with(limits.position_max_rad, f64::min);
            let (from, to) = (pose(a), pose(b));
            let motion = plan_move(&from, &to, part, &limits).unwrap();
            prop_assert_eq!(motion.start(), from);
            prop_assert_eq!(motion.state_at(motion.duration_s()).q, to);
            prop_assert_eq!(verify(&motion, &limits), Ok(()));
        }
    }

    #[test]
    fn a_move_lasts_as_long_as_is_asked_or_as_the_limits_allow() {
        let mut to = START_POSE;
        (to[0], to[5]) = (to[0] + 0.4, to[5] - 0.1);
        let limits = Limits::default();
        for (wanted_s, lasts_s) in [(3.5, Some(3.5)), (0.01, None)] {
            let part = fraction_that_lasts(&START_POSE, &to, wanted_s, &limits).unwrap();
            let motion = plan_move(&START_POSE, &to, part, &limits).unwrap();
            let fastest = plan_move(&START_POSE, &to, 1.0, &limits).unwrap();
            let lasts_s = lasts_s.unwrap_or_else(|| fastest.duration_s());
            assert!((motion.duration_s() - lasts_s).abs() < 1e-3, "{wanted_s}");
        }
    }

    #[test]
    fn staying_is_a_move_of_no_time() {
        let motion = plan_move(&START_POSE, &START_POSE, 0.5, &Limits::default()).unwrap();
        assert!(motion.duration_s() < 1e-9);
        assert_eq!(motion.state_at(0.0).q, START_POSE);
    }

    /// Joint 7 by 0.3 rad: its full speed is not reached, so four jerk phases of
    /// tj = 0.04 s and two of constant a = 20 rad/s² remain, and from
    /// `x = a (T/2) (T/2 - tj)` follows `T/2 = tj/2 + sqrt(tj²/4 + x/a)`.
    #[test]
    fn known_duration() {
        let mut to = START_POSE;
        to[6] += 0.3;
        let motion = plan_move(&START_POSE, &to, 1.0, &Limits::default()).unwrap();
        let half = 0.02 + (0.0004_f64 + 0.3 / 20.0).sqrt();
        assert!(
            (motion.duration_s() - 2.0 * half).abs() < 1e-6,
            "{}",
            motion.duration_s()
        );
    }

    #[test]
    fn nonsense_is_refused() {
        let limits = Limits::default();
        let joint_2 = JointVector([0.0, 9.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for (to, part, fault, said) in [
            (START_POSE, 0.0, FaultCode::PlanOutOfLimits, "is 0,"),
            (START_POSE, f64::NAN, FaultCode::PlanOutOfLimits, "is NaN"),
            (joint_2, 0.5, FaultCode::SetpointPosition, "joint 2 "),
            (
                JointVector::splat(f64::NAN),
                0.5,
                FaultCode::SetpointPosition,
                "joint 1 ",
            ),
        ] {
            let error = plan_move(&START_POSE, &to, part, &limits).unwrap_err();
            assert_eq!(error.fault, fault);
            assert!(error.to_string().contains(said), "{error}");
        }
    }
}
