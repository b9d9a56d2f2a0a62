//! The wiggle: a windowed sine of joint 6 about the start pose.
//!
//! Paper, "Observation Collection with Safe Action": a planar oscillation of
//! joint 6 that excites the rope while it stays in view, filmed for 400 frames
//! at 60 frames a second, the last part of them at rest.

use crate::OutOfRange;
use crate::collide::{ArmShape, RopeShape, rope_clearance_m};
use arm_model::joint::START_POSE;
use arm_model::{Cell, JointTrajectory, JointVector, Limits, Pole, TrajectoryError};
use nalgebra::Vector3;
use rope_sim::{
    Candidate, FrameTimes, Outcome, PlannedArm, Precision, Rollout, SimOptions, SimulateError,
    roll_out,
};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;

/// Joint that oscillates, 0-based: joint 6.
const JOINT: usize = 5;
/// Time between knots of the spline (s).
const KNOT_S: f64 = 0.04;

/// Shape of the wiggle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WiggleConfig {
    /// Pose about which joint 6 oscillates (rad).
    pub pose_rad: JointVector,
    /// Amplitude (rad).
    pub amplitude_rad: f64,
    /// Frequency (Hz).
    pub frequency_hz: f64,
    /// Duration of the oscillation (s).
    pub duration_s: f64,
    /// Time over which it fades in and out (s).
    pub ramp_s: f64,
    /// Duration of the whole filmed motion, still end included (s).
    pub filmed_s: f64,
}

impl Default for WiggleConfig {
    /// 16.5 degrees at 1.3 Hz under a window that opens and closes over the whole
    /// time: well above the pendulum frequencies of the ranges' ropes (0.6 to
    /// 0.8 Hz, stiff ones up to 1 Hz), so that none swings out by its whole length
    /// and little sway is left at the end. A large planar sway does not stay
    /// planar, and cannot be predicted for long. The paper's 25 degrees at 0.75 Hz
    /// throw ropes of 0.55 m and more against the column in this pose.
    fn default() -> Self {
        Self {
            pose_rad: START_POSE,
            amplitude_rad: 16.5_f64.to_radians(),
            frequency_hz: 1.3,
            duration_s: 5.6,
            ramp_s: 2.8,
            filmed_s: 6.7,
        }
    }
}

/// Durations of oscillation, ramps and film of a short wiggle (s).
const SHORT_S: [f64; 3] = [3.0, 1.5, 3.4];

impl WiggleConfig {
    /// The same oscillation for half as long, about another pose: what it tells about lengths
    /// has a quarter more deviation, and about all else as little (`wag wiggle --evaluate`).
    #[must_use]
    pub fn short(&self, pose_rad: JointVector) -> Self {
        let [duration_s, ramp_s, filmed_s] = SHORT_S;
        Self {
            pose_rad,
            duration_s,
            ramp_s,
            filmed_s,
            ..*self
        }
    }
}

/// Why there is no wiggle.
#[derive(Debug, thiserror::Error)]
pub enum WiggleError {
    /// A value is out of range.
    #[error("wiggle: {0}")]
    Value(#[from] OutOfRange),
    /// The spline cannot be made.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The motion breaks a limit of the arm.
    #[error("wiggle breaks a limit: {what}; use a smaller amplitude or frequency")]
    BreaksLimit {
        /// The limit, with value and time.
        what: String,
    },
    /// The rope simulator refused or failed.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
}

impl WiggleConfig {
    fn check(&self) -> Result<(), WiggleError> {
        const AMPLITUDE: &str = "above 0 and below 1.5 rad";
        const FREQUENCY: &str = "above 0 and at most 3 Hz";
        const RAMP: &str = "above 0 and at most half of `duration_s`";
        const FILMED: &str = "at least `duration_s` and at most 10 s";
        let (a, f, whole_s) = (self.amplitude_rad, self.frequency_hz, self.duration_s);
        let (ramp_s, filmed_s) = (self.ramp_s, self.filmed_s);
        let ramp_fits = ramp_s > 0.0 && 2.0 * ramp_s <= whole_s;
        let film_fits = filmed_s >= whole_s && filmed_s <= 10.0;
        let rules = [
            ("amplitude_rad", a, a > 0.0 && a < 1.5, AMPLITUDE),
            ("frequency_hz", f, f > 0.0 && f <= 3.0, FREQUENCY),
            ("ramp_s", ramp_s, ramp_fits, RAMP),
            ("filmed_s", filmed_s, film_fits, FILMED),
        ];
        Ok(OutOfRange::check(rules)?)
    }

    /// Deflection of joint 6 at `t_s` (rad): `A sin(2π f t)` faded in and out by
    /// quintic steps.
    #[must_use]
    pub fn deflection_rad(&self, t_s: f64) -> f64 {
        let fade =
            smooth_step(t_s / self.ramp_s) * smooth_step((self.duration_s - t_s) / self.ramp_s);
        self.amplitude_rad * (core::f64::consts::TAU * self.frequency_hz * t_s).sin() * fade
    }
}

/// Quintic step from 0 to 1 with zero speed and acceleration at both ends.
pub(crate) fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * x * (10.0 + x * (6.0 * x - 15.0))
}

/// The wiggle as a joint trajectory of `filmed_s`.
///
/// # Errors
/// Values out of range, or a motion the arm may not execute.
pub fn wiggle(config: &WiggleConfig, limits: &Limits) -> Result<JointTrajectory, WiggleError> {
    let trajectory = unlimited(config)?;
    match limits.worst_violation(&trajectory) {
        Some(margin) => Err(WiggleError::BreaksLimit {
            what: margin.describe(),
        }),
        None => Ok(trajectory),
    }
}

/// The planned motion of an arm with the usual limits and pole that makes this wiggle.
///
/// # Errors
/// As [`wiggle`].
pub fn wiggling_arm(config: &WiggleConfig) -> Result<PlannedArm, WiggleError> {
    let trajectory = wiggle(config, &Limits::default())?;
    Ok(PlannedArm::new(trajectory, Pole::default()))
}

/// [`wiggle`] of an arm without limits: for simulations only.
pub fn unlimited(config: &WiggleConfig) -> Result<JointTrajectory, WiggleError> {
    config.check()?;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "checked above: a few hundred at most"
    )]
    let segments = (config.filmed_s / KNOT_S).round() as u32;
    let (times, poses): (Vec<f64>, Vec<JointVector>) = (0..=segments)
        .map(|i| {
            let t = config.filmed_s * f64::from(i) / f64::from(segments);
            let mut q = config.pose_rad;
            q[JOINT] += config.deflection_rad(t);
            (t, q)
        })
        .unzip();
    Ok(JointTrajectory::new(&times, &poses)?)
}

/// Smallest gap between the surface of each of `ropes` and column or arm during the wiggle
/// and one second after it (m), and how its simulation went: one that diverged holds the last
/// shape that is finite.
///
/// # Errors
/// What the rope simulator refuses.
pub fn clearance_m(
    trajectory: &JointTrajectory,
    ropes: &[RopeParams],
    cell: &Cell,
    threads: usize,
) -> Result<Vec<(f64, Outcome)>, WiggleError> {
    const PERIOD_S: f64 = 0.02;
    let arm = PlannedArm::new(*trajectory, cell.pole);
    let candidates: Vec<Candidate<'_>> = ropes
        .iter()
        .map(|rope| Candidate::new(rope, &arm))
        .collect();
    let horizon_s = trajectory.duration_s() + 1.0;
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a positive count of a few hundred"
    )]
    let count = (horizon_s / PERIOD_S).floor() as usize;
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: PERIOD_S,
            count,
        },
        threads,
        ..SimOptions::new(1e-3, Precision::F32, horizon_s)
    };
    let rollouts = roll_out(&candidates, &options)?;
    let gap_m = |(rope, rollout): (&RopeParams, &Rollout)| {
        let shape = RopeShape::from(rope);
        let mut gap_m = f64::INFINITY;
        let mut time_s = 0.0;
        for frame in 0..rollout.nodes.frames() {
            let pose = ArmShape::at(&trajectory.state_at(time_s).q, &cell.pole);
            let nodes: Vec<Vector3<f64>> = (0..rollout.nodes.nodes())
                .map(|node| rollout.nodes.position(frame, node))
                .collect();
            gap_m = gap_m.min(rope_clearance_m(&pose, cell, &shape, &nodes));
            time_s += PERIOD_S;
        }
        (gap_m, rollout.outcome)
    };
    Ok(ropes.iter().zip(&rollouts).map(gap_m).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ropes::random_rope;

    #[test]
    fn the_wiggle_is_a_faded_sine_of_joint_6_alone() {
        let config = WiggleConfig::default();
        let t = wiggle(&config, &Limits::default()).unwrap();
        assert!(t.duration_s() >= 400.0 / 60.0 && t.waypoint_count() <= 256);
        for j in 0..7 {
            let e = t.extrema(j);
            let amplitude = (e.q_max.value - START_POSE[j]).max(START_POSE[j] - e.q_min.value);
            let expected = if j == JOINT {
                config.amplitude_rad
            } else {
                0.0
            };
            assert!((amplitude - expected).abs() < 0.02, "joint {}", j + 1);
        }
        // Still after the oscillation, but for what a spline rings at its knots.
        assert!(t.state_at(6.0).qd.max_abs() < 1e-9);
        for k in 0..600 {
            let s = f64::from(k) * 0.01;
            let want = START_POSE[JOINT] + config.deflection_rad(s);
            assert!((t.state_at(s).q[JOINT] - want).abs() < 1e-3);
        }
    }

    #[test]
    fn a_wiggle_beyond_the_limits_is_refused() {
        let wild = WiggleConfig {
            amplitude_rad: 0.9,
            frequency_hz: 2.0,
            ..WiggleConfig::default()
        };
        assert!(matches!(
            wiggle(&wild, &Limits::default()),
            Err(WiggleError::BreaksLimit { .. })
        ));
        let wrong = WiggleConfig {
            ramp_s: 3.0,
            ..WiggleConfig::default()
        };
        assert!(matches!(
            wiggle(&wrong, &Limits::default()),
            Err(WiggleError::Value(OutOfRange { key: "ramp_s", .. }))
        ));
    }

    #[test]
    fn ropes_of_the_ranges_stay_clear_of_column_and_arm() {
        let t = wiggle(&WiggleConfig::default(), &Limits::default()).unwrap();
        let ropes: Vec<_> = (0..64).map(random_rope).collect();
        let gaps = clearance_m(&t, &ropes, &Cell::default(), 2).unwrap();
        for (gap_m, outcome) in gaps {
            assert!(gap_m > 0.15 && outcome != Outcome::Diverged, "{gap_m}");
        }
    }
}
