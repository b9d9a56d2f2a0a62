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
    /// The arm is not known to stand where and when the move begins.
    #[error("{0}")]
    Start(String),
    /// The knots make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// Even the plain move breaks a limit of the arm.
    #[error("a plain move to the end pose breaks a limit: {0}; use longer `durations_s`")]
    BreaksLimit(String),
    /// Even the plain move brings rope or tool too near to something: gap of the rope (m).
    #[error(
        "every settling move brings the rope within {0:.3} m of arm or column or lets the tool collide; let the rope settle or choose another end pose"
    )]
    TooClose(f64),
    /// The rope simulator refused.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Slopes of the residual vibration could not be taken.
    #[error(transparent)]
    Sensitivity(#[from] SensitivityError),
    /// The caller broke off after so many Gauss-Newton steps.
    #[error("the settling move was cancelled after step {0}")]
    Cancelled(usize),
    /// The simulated rope blew up.
    #[error("the simulation of the rope diverged; identify the rope again")]
    Diverged,
}
