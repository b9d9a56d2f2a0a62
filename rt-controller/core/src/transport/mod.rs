//! How setpoints reach an arm and replies come back: what the cycle asks of a
//! command link. Sockets are not here.

pub mod slot;

use crate::control::LinkInput;
use crate::xarm::Command;

/// The connection is gone for good; open a new one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the connection to the arm is gone")]
pub struct LinkGone;

/// What became of the commands of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sent {
    /// All were handed to the network.
    Whole,
    /// One or more were not sent: the network or the arm has not taken the ones
    /// before. Nothing is queued, so nothing bursts out later.
    Skipped,
}

/// Commands of one cycle at most: a setpoint and a request.
pub const MAX_COMMANDS: usize = 2;

/// A command link to an arm. Both calls are made once per cycle and are
/// RT-safe: bounded, no allocation, no waiting, one system call at most.
pub trait ArmTransport {
    /// Sends the commands of a cycle, none to [`MAX_COMMANDS`], in one write at
    /// `now_ns` (CLOCK_MONOTONIC).
    ///
    /// # Errors
    /// [`LinkGone`].
    fn send(&mut self, commands: &[Command], now_ns: u64) -> Result<Sent, LinkGone>;

    /// Takes in, in one read, the replies that have come until `now_ns`; `lost`
    /// in the result says that the connection is gone.
    fn poll(&mut self, now_ns: u64) -> LinkInput;
}
