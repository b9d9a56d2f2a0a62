//! Why there is no settling move.

use crate::OutOfRange;
use arm_model::TrajectoryError;
use rope_sim::sensitivity::SensitivityError;
use rope_sim::{MotionError, SimulateError};
use shared_types::rope::RopeError;

/// Why there is no settling move.
#[derive(Debug, thiserror::Error)]
pub enum SettleError {
    /// A value of the configuration is out of range.
    #[error("settle: {0}")]
    Value(#[from] OutOfRange),
    /// The configuration names no duration.
    #[error("settle: `durations_s` is empty; name at least one duration")]
    NoDuration,
    /// The rope's parameters are not physical.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// The measured joints make no motion.
    #[error("measured joints: {0}")]
    Joints(#[from] MotionError),
    /// The move would begin while the arm is still being measured.
    #[error(
        "the settling move would begin {start_s:.3} s after the rope hung still, but the joints were measured until {last_s:.3} s; begin it later"
    )]
    StartsTooEarly {
        /// Start asked for (s).
        start_s: f64,
        /// Last measured sample (s).
        last_s: f64,
    },
    /// The arm is not where the move begins.
    #[error(
        "joint {joint} stands {off_rad:.4} rad away from the start of the settling move; hold the start pose first"
    )]
    NotAtStart {
        /// Joint, 1-based.
        joint: usize,
        /// Measured minus commanded position (rad).
        off_rad: f64,
    },
    /// The knots make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// Even the plain move breaks a limit of the arm.
    #[error("a plain move to the end pose breaks a limit: {what}; use longer `durations_s`")]
    BreaksLimit {
        /// The limit, with value and time.
        what: String,
    },
    /// Even the plain move brings rope or tool too near to something.
    #[error(
        "every settling move brings the rope within {gap_m:.3} m of arm or column or lets the tool collide; let the rope settle or choose another end pose"
    )]
    TooClose {
        /// Smallest gap of the rope in the plain move (m).
        gap_m: f64,
    },
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Slopes of the residual vibration could not be taken.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// The caller broke off.
    #[error("the settling move was cancelled after step {step}")]
    Cancelled {
        /// Gauss-Newton steps done.
        step: usize,
    },
    /// The simulated rope blew up.
    #[error("the simulation of the rope diverged; identify the rope again")]
    Diverged,
}
