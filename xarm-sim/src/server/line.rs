//! The sending side of a connection: whole frames, never waiting.

use crate::history::lock;
use socket2::SockRef;
use std::io;
use std::net::{Shutdown, TcpStream};
use std::sync::Mutex;
use std::time::Duration;

/// Linux: this call does not wait, although the socket is a waiting one (its
/// reader waits).
const MSG_DONTWAIT: i32 = 0x40;
/// Linux: a client that is gone is an error, not a signal.
const MSG_NOSIGNAL: i32 = 0x4000;

/// A connection, shared by the thread that reads it and those that send.
#[derive(Debug)]
pub(super) struct Line {
    pub(super) stream: TcpStream,
    /// Rest of a frame that was sent in part; locked while frames are taken,
    /// so that they stay in order.
    unsent: Mutex<Vec<u8>>,
}

impl Line {
    pub(super) fn new(stream: TcpStream) -> Self {
        Self {
            stream,
            unsent: Mutex::default(),
        }
    }

    /// Sends frames as long as there are some and the socket takes them, each
    /// in a send of its own: the vendor's C++ client loses its place otherwise.
    pub(super) fn send(&self, mut next: impl FnMut() -> Option<Vec<u8>>) -> io::Result<()> {
        let mut unsent = lock(&self.unsent);
        loop {
            if unsent.is_empty() {
                match next() {
                    Some(frame) => *unsent = frame,
                    None => return Ok(()),
                }
            }
            let sent = self.send_some(&unsent)?;
            unsent.drain(..sent);
            if !unsent.is_empty() {
                return Ok(());
            }
        }
    }

    /// Bytes taken by the socket without waiting, 0 when it is full.
    fn send_some(&self, bytes: &[u8]) -> io::Result<usize> {
        let socket = SockRef::from(&self.stream);
        let sent = socket.send_with_flags(bytes, MSG_DONTWAIT | MSG_NOSIGNAL);
        sent.or_else(|error| match error.kind() {
            io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted => Ok(0),
            _ => Err(error),
        })
    }

    /// Ends the connection in order or by a reset, and wakes its reader.
    pub(super) fn close(&self, by_reset: bool) {
        if by_reset {
            // The last handle to close sends the reset then. An error means
            // that the client was faster, here as below.
            let _ = SockRef::from(&self.stream).set_linger(Some(Duration::ZERO));
            let _ = self.stream.shutdown(Shutdown::Read);
        } else {
            let _ = self.stream.shutdown(Shutdown::Both);
        }
    }
}
