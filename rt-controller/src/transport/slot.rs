//! The place of the loop's command link: empty, connected, or just broken.

use super::ArmTransport;
use crate::control::{ArmCommand, CycleOutput, LinkInput};
use crate::xarm::Command;

/// Holds at most one link. RT-safe; links are made and dropped elsewhere.
#[derive(Debug)]
pub struct LinkSlot<T> {
    link: Option<Box<T>>,
    lost: bool,
}

impl<T> Default for LinkSlot<T> {
    fn default() -> Self {
        Self {
            link: None,
            lost: false,
        }
    }
}

impl<T: ArmTransport> LinkSlot<T> {
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

    /// Sends a cycle's command and request, in this order.
    pub fn send(&mut self, out: &CycleOutput, now_ns: u64) {
        let Some(link) = self.link.as_mut() else {
            return;
        };
        let setpoint = out.command.map(on_the_wire);
        let request = out.request.map(Command::SetState);
        for command in [setpoint, request].into_iter().flatten() {
            self.lost |= link.send(&command, now_ns).is_err();
        }
    }
}

/// The request that carries a command.
fn on_the_wire(command: ArmCommand) -> Command {
    match command {
        ArmCommand::Position(q) => Command::ServoJoint(q),
        ArmCommand::Velocity { qd, duration_s } => Command::JointVelocity {
            velocity: qd,
            // Each joint takes its own velocity at once; waiting for the slowest
            // would bend the path.
            synchronised: false,
            duration_s: Some(duration_s),
        },
    }
}
