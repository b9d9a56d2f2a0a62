//! A command link that notes how long its receive call takes.

use crate::control::LinkInput;
use crate::os::now_ns;
use crate::transport::tcp::TcpLink;
use crate::transport::{ArmTransport, LinkGone, Sent};
use crate::xarm::Command;
use rtrb::Producer;

/// A link with a stop-watch. RT-safe.
#[derive(Debug)]
pub(super) struct TimedLink {
    link: TcpLink,
    /// Duration of each poll (ns), in the order of the cycles.
    polls: Producer<u32>,
}

impl TimedLink {
    pub(super) fn new(link: TcpLink, polls: Producer<u32>) -> Self {
        Self { link, polls }
    }
}

impl ArmTransport for TimedLink {
    fn send(&mut self, commands: &[Command], now_ns: u64) -> Result<Sent, LinkGone> {
        self.link.send(commands, now_ns)
    }

    fn poll(&mut self, at_ns: u64) -> LinkInput {
        let began_ns = now_ns();
        let seen = self.link.poll(at_ns);
        let span_ns = now_ns().saturating_sub(began_ns);
        let _ = self.polls.push(u32::try_from(span_ns).unwrap_or(u32::MAX));
        seen
    }
}
