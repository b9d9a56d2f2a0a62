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
pub mod tcp;

pub use control_core::transport::{ArmTransport, LinkGone, MAX_COMMANDS};

/// A connected stream of bytes that never makes its user wait: a socket, or a
/// cable in virtual time.
pub trait ByteStream {
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
