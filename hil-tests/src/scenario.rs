//! Fault-injection scenarios: a script of faults, an arm in servo mode, a motion.

use arm_model::{JointTrajectory, JointVector, TrajectoryError};
use rt_controller::control::Motion;
use rt_controller::xarm::{Command, Mode, StateRequest};

/// An entry of a fault script: when, then the kind of the fault and its fields, as in
/// `entry("at_s = 0.5", "stall, duration_s = 0.19")`.
#[must_use]
pub fn entry(when: &str, fault: &str) -> String {
    let (kind, fields) = fault.split_once(", ").unwrap_or((fault, ""));
    let fields = fields.replace(", ", "\n");
    format!("[[fault]]\n{when}\nkind = '{kind}'\n{fields}\n")
}

/// What brings an arm up in a mode, whatever was before.
#[must_use]
pub fn bring_up(mode: Mode) -> [Command; 5] {
    [
        Command::CleanError,
        Command::CleanWarning,
        Command::MotionEnable {
            joint: Command::ALL_JOINTS,
            enable: true,
        },
        Command::SetMode(mode),
        Command::SetState(StateRequest::Ready),
    ]
}

/// A swing of three joints from `from` and back, 1.5 s.
///
/// # Errors
/// A pose that is no pose.
pub fn swing(from: JointVector) -> Result<Motion, TrajectoryError> {
    let mut out = from;
    (out[1], out[3], out[5]) = (out[1] + 0.10, out[3] - 0.10, out[5] + 0.40);
    JointTrajectory::new(&[0.0, 0.75, 1.5], &[from, out, from]).map(Motion::Spline)
}
