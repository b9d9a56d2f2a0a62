//! The two ways setpoints travel: streamed joint positions, or joint velocities
//! that the arm forgets by itself.

use crate::control::ArmCommand;
use crate::xarm::{Command, Mode};
use shared_types::WireMode;

/// How commands look on the wire. RT-safe.
pub trait WireBackend: Sync {
    /// Mode of the arm in which it takes these commands.
    fn mode(&self) -> Mode;

    /// The request that carries `command`; `None` for one that belongs to the
    /// other wire, which must never be sent in this mode.
    fn request(&self, command: &ArmCommand) -> Option<Command>;
}

/// Mode 1, register 29.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ServoPosition;

/// Mode 4, register 81 with a duration (firmware 1.8): the arm stops by itself
/// when nothing follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct JointVelocity;

impl WireBackend for ServoPosition {
    fn mode(&self) -> Mode {
        Mode::Servo
    }

    fn request(&self, command: &ArmCommand) -> Option<Command> {
        match command {
            ArmCommand::Position(q) => Some(Command::ServoJoint(*q)),
            ArmCommand::Velocity { .. } => None,
        }
    }
}

impl WireBackend for JointVelocity {
    fn mode(&self) -> Mode {
        Mode::JointVelocity
    }

    fn request(&self, command: &ArmCommand) -> Option<Command> {
        match command {
            ArmCommand::Position(_) => None,
            ArmCommand::Velocity { qd, duration_s } => Some(Command::JointVelocity {
                velocity: *qd,
                // Each joint takes its own velocity at once; waiting for the
                // slowest would bend the path.
                synchronised: false,
                // Without a duration the arm would move on for ever.
                duration_s: Some(*duration_s).filter(|s| *s > 0.0),
            })
            .filter(|request| {
                matches!(
                    request,
                    Command::JointVelocity {
                        duration_s: Some(_),
                        ..
                    }
                )
            }),
        }
    }
}

/// The back-end of a configured wire.
#[must_use]
pub const fn backend(wire: WireMode) -> &'static dyn WireBackend {
    match wire {
        WireMode::ServoPosition => &ServoPosition,
        WireMode::JointVelocity => &JointVelocity,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;

    #[test]
    fn each_wire_carries_its_own_commands_only() {
        let q = JointVector::splat(0.3);
        let position = ArmCommand::Position(q);
        let velocity = |duration_s| ArmCommand::Velocity { qd: q, duration_s };
        let servo = backend(WireMode::ServoPosition);
        assert_eq!(servo.mode().code(), WireMode::ServoPosition.arm_mode());
        assert_eq!(servo.request(&position), Some(Command::ServoJoint(q)));
        assert_eq!(servo.request(&velocity(0.012)), None);
        let joint = backend(WireMode::JointVelocity);
        assert_eq!(joint.mode().code(), WireMode::JointVelocity.arm_mode());
        assert_eq!(joint.request(&position), None);
        assert!(joint.request(&velocity(0.012)).is_some());
        for endless in [0.0, -1.0, f64::NAN] {
            assert_eq!(joint.request(&velocity(endless)), None);
        }
    }
}
