//! The place of the loop's command link: empty, connected, or just broken.

use super::{ArmTransport, MAX_COMMANDS};
use crate::control::{ArmCommand, LinkInput};
use crate::xarm::{Command, StateRequest};
use alloc::boxed::Box;
use shared_types::CommandInterface;

/// Holds at most one link. RT-safe; links are made and dropped elsewhere.
#[derive(Debug)]
pub struct LinkSlot<T> {
    link: Option<Box<T>>,
    lost: bool,
    interface: CommandInterface,
}

impl<T> LinkSlot<T> {
    /// Empty; commands will travel by `interface`.
    #[must_use]
    pub const fn new(interface: CommandInterface) -> Self {
        Self {
            link: None,
            lost: false,
            interface,
        }
    }
}

impl<T: ArmTransport> LinkSlot<T> {
    /// Whether there is a link.
    #[must_use]
    pub const fn is_connected(&self) -> bool {
        self.link.is_some()
    }

    /// Puts a fresh link in; the old one comes back, to be dropped elsewhere.
    #[must_use]
    pub fn replace(&mut self, fresh: Option<Box<T>>) -> Option<Box<T>> {
        self.lost = false;
        core::mem::replace(&mut self.link, fresh)
    }

    /// What the link showed since the last call, a failed send included; no
    /// link at all is a lost one.
    pub fn poll(&mut self, now_ns: u64) -> LinkInput {
        let none = LinkInput {
            lost: true,
            ..LinkInput::default()
        };
        let mut seen = self.link.as_mut().map_or(none, |link| link.poll(now_ns));
        seen.lost |= core::mem::take(&mut self.lost);
        seen
    }

    /// Sends a cycle's command and request for a state, in this order and at once. Call it
    /// every cycle: without a command a question of the link's own may go out.
    pub fn send(&mut self, command: Option<ArmCommand>, state: Option<StateRequest>, now_ns: u64) {
        let Some(link) = self.link.as_mut() else {
            return;
        };
        let setpoint = command.and_then(|c| request(self.interface, &c));
        let state = state.map(Command::SetState);
        let mut commands: heapless::Vec<Command, MAX_COMMANDS> = heapless::Vec::new();
        for command in [setpoint, state].into_iter().flatten() {
            // Two at most: they fit.
            let _ = commands.push(command);
        }
        self.lost |= link.send(&commands, now_ns).is_err();
    }
}

/// The request that carries `command`: register 29 for positions, register 81 with a
/// duration (firmware 1.8) for velocities. `None` for a command of the other
/// interface, which must never be sent in this mode. RT-safe.
fn request(interface: CommandInterface, command: &ArmCommand) -> Option<Command> {
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
