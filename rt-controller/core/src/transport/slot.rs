//! The place of the loop's command link: empty, connected, or just broken.

use super::command_interface::request;
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
