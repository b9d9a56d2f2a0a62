//! How setpoints reach an arm and replies come back: what the cycle asks of a
//! command link. Sockets are not here.

use crate::control::{ArmCommand, LinkInput};
use crate::xarm::Command;
use shared_types::CommandInterface;

/// The connection is gone for good; open a new one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the connection to the arm is gone")]
pub struct LinkGone;

/// Commands of one cycle at most: a setpoint and a request.
pub const MAX_COMMANDS: usize = 2;

/// A command link to an arm. Both calls are made once per cycle and are
/// RT-safe: bounded, no allocation, no waiting, one system call at most.
pub trait ArmTransport {
    /// Sends the commands of a cycle, none to [`MAX_COMMANDS`], in one write at
    /// `now_ns` (CLOCK_MONOTONIC). Those that the network or the arm has no room for
    /// are left out and counted by the next poll: nothing is queued, so nothing
    /// bursts out later.
    fn send(&mut self, commands: &[Command], now_ns: u64) -> Result<(), LinkGone>;

    /// Takes in, in one read, the replies that have come until `now_ns`; `lost`
    /// in the result says that the connection is gone.
    fn poll(&mut self, now_ns: u64) -> LinkInput;
}

/// The request that carries `command`: register 29 for positions, register 81 with a
/// duration (firmware 1.8) for velocities. `None` for a command of the other
/// interface, which must never be sent in this mode. RT-safe.
pub(crate) fn request(interface: CommandInterface, command: &ArmCommand) -> Option<Command> {
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
    }
}
