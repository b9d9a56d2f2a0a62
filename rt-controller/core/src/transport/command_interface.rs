//! The two command interfaces of the arm: streamed joint positions, or joint
//! velocities that the arm forgets by itself.

use crate::control::ArmCommand;
use crate::xarm::{Command, Mode};
use shared_types::CommandInterface;

/// Mode of the arm in which it takes commands by `interface`.
#[must_use]
pub const fn arm_mode(interface: CommandInterface) -> Mode {
    match interface {
        CommandInterface::ServoPosition => Mode::Servo,
        CommandInterface::JointVelocity => Mode::JointVelocity,
    }
}

/// The request that carries `command`: register 29 for positions, register 81 with a
/// duration (firmware 1.8) for velocities. `None` for a command of the other
/// interface, which must never be sent in this mode. RT-safe.
#[must_use]
pub fn request(interface: CommandInterface, command: &ArmCommand) -> Option<Command> {
    match (interface, command) {
        (CommandInterface::ServoPosition, ArmCommand::Position(q)) => Some(Command::ServoJoint(*q)),
        // Without a duration the arm would move on for ever.
        (CommandInterface::JointVelocity, ArmCommand::Velocity { qd, duration_s })
            if *duration_s > 0.0 =>
        {
            Some(Command::JointVelocity {
                velocity: *qd,
                // Each joint takes its own velocity at once; waiting for the
                // slowest would bend the path.
                synchronised: false,
                duration_s: Some(*duration_s),
            })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use CommandInterface::{JointVelocity, ServoPosition};
    use arm_model::JointVector;

    #[test]
    fn each_interface_carries_its_own_commands_only() {
        let q = JointVector::splat(0.3);
        let position = ArmCommand::Position(q);
        let velocity = |duration_s| ArmCommand::Velocity { qd: q, duration_s };
        let servo = Some(Command::ServoJoint(q));
        assert_eq!(request(ServoPosition, &position), servo);
        assert_eq!(request(ServoPosition, &velocity(0.012)), None);
        assert_eq!(request(JointVelocity, &position), None);
        assert!(request(JointVelocity, &velocity(0.012)).is_some());
        for endless in [0.0, -1.0, f64::NAN] {
            assert_eq!(request(JointVelocity, &velocity(endless)), None);
        }
        for interface in [ServoPosition, JointVelocity] {
            assert_eq!(arm_mode(interface).code(), interface.arm_mode());
        }
    }
}
