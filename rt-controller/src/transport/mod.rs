//! How setpoints reach an arm and replies come back, without ever waiting.
//!
//! The loop sees [`ArmTransport`] only. [`tcp`] is the real wire; [`sim`] is an
//! ideal arm in memory, for tests in virtual time.
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

pub mod heartbeat;
pub mod in_flight;
pub mod sim;
pub mod slot;
pub mod tcp;
pub mod wire;

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

/// A connected stream of bytes that never makes its user wait: a socket, or a
/// cable in virtual time.
pub trait ByteWire {
    /// Reads what has come: how many bytes, and when they arrived
    /// (CLOCK_MONOTONIC, ns) where that is known. No byte means the end.
    ///
    /// # Errors
    /// `WouldBlock` when nothing has come; anything else ends the connection.
    fn receive(&mut self, into: &mut [u8]) -> std::io::Result<(usize, Option<u64>)>;

    /// Writes as much of `bytes` as is taken at once.
    ///
    /// # Errors
    /// `WouldBlock` when nothing is taken now; anything else ends the
    /// connection.
    fn send(&mut self, bytes: &[u8]) -> std::io::Result<usize>;
}

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
