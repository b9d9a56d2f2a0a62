//! What is asked of a camera's driver, one system call each: the seam behind which
//! tests put a camera of their own.

use std::fmt::Debug;
use std::io;
use std::time::Duration;

use super::abi::{Buffer, PixFormat};

/// What a device is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Identity {
    /// Driver's name, e.g. `uvcvideo`.
    pub(super) driver: String,
    /// Camera's name.
    pub(super) card: String,
    /// What it can do ([`super::abi::CAN_CAPTURE`] and so on).
    pub(super) capabilities: u32,
}

/// A video device. Errors are the system's.
pub(super) trait Device: Debug {
    fn identity(&mut self) -> io::Result<Identity>;

    /// Asks for a format; returns what was granted.
    fn set_format(&mut self, format: PixFormat) -> io::Result<PixFormat>;

    /// Asks for a time per frame (s, as a fraction); returns what was granted, `None`
    /// where the driver leaves no choice.
    fn set_rate(&mut self, timeperframe: [u32; 2]) -> io::Result<Option<[u32; 2]>>;

    /// Asks for buffers and maps them; returns how many there are.
    fn map_buffers(&mut self, count: u32) -> io::Result<u32>;

    /// Gives a buffer to the driver.
    fn queue(&mut self, index: u32) -> io::Result<()>;

    /// Takes the oldest filled buffer; `WouldBlock` when there is none.
    fn dequeue(&mut self) -> io::Result<Buffer>;

    /// What lies in a buffer that was taken; empty for any other.
    fn bytes(&self, index: u32) -> &[u8];

    /// Starts or ends the stream.
    fn stream(&mut self, on: bool) -> io::Result<()>;

    /// Waits for a filled buffer, or for the device to fail; false after `timeout`.
    fn wait(&self, timeout: Duration) -> io::Result<bool>;

    /// Sets an ordinary control; returns what was granted.
    fn set_control(&mut self, id: u32, value: i32) -> io::Result<i32>;

    /// A query of a vendor's extension unit; `place` is its number and the selector.
    fn extension(&mut self, place: [u8; 2], query: u8, data: &mut [u8]) -> io::Result<()>;
}
