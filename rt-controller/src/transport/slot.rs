//! The place of the loop's command link: empty, connected, or just broken.

use super::ArmTransport;
use crate::control::{CycleOutput, LinkInput};
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

    /// Sends a cycle's setpoint and request, in this order.
    pub fn send(&mut self, out: &CycleOutput, now_ns: u64) {
        let Some(link) = self.link.as_mut() else {
            return;
        };
        let setpoint = out.setpoint.map(Command::ServoJoint);
        let request = out.request.map(Command::SetState);
        for command in [setpoint, request].into_iter().flatten() {
            self.lost |= link.send(&command, now_ns).is_err();
        }
    }
}
