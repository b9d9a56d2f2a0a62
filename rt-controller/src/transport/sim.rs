//! An ideal arm in memory: it takes every setpoint at once and answers it at
//! the next poll. Faults are set by hand.

use super::{ArmTransport, LinkGone};
use crate::control::LinkInput;
use crate::xarm::{Command, Status};

/// An arm that answers and has no joints.
#[derive(Debug, Default)]
pub struct IdealArm {
    /// No replies come while this is set.
    pub stalled: bool,
    /// The connection is gone.
    pub gone: bool,
    /// When the oldest unanswered command was sent (ns).
    pub oldest_ns: Option<u64>,
}

impl ArmTransport for IdealArm {
    fn send(&mut self, commands: &[Command], now_ns: u64) -> Result<(), LinkGone> {
        if self.gone {
            return Err(LinkGone);
        }
        if !commands.is_empty() {
            self.oldest_ns = self.oldest_ns.or(Some(now_ns));
        }
        Ok(())
    }

    fn poll(&mut self, now_ns: u64) -> LinkInput {
        let waited_ns = self.oldest_ns.map_or(0, |t| now_ns.saturating_sub(t));
        if self.gone || self.stalled || self.oldest_ns.is_none() {
            return LinkInput {
                lost: self.gone,
                unanswered_ns: waited_ns,
                ..LinkInput::default()
            };
        }
        self.oldest_ns = None;
        LinkInput {
            status: Some(Status(0)),
            reply_ns: u32::try_from(waited_ns).unwrap_or(u32::MAX),
            ..LinkInput::default()
        }
    }
}
