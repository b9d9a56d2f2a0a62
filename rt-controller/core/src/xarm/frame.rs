//! Request and reply frames of the command port.
//!
//! | bytes | field |
//! |---|---|
//! | 0-1 | transaction id, u16 big-endian, echoed |
//! | 2-3 | protocol id, u16 big-endian, echoed |
//! | 4-5 | length, u16 big-endian: bytes that follow |
//! | 6 | register, echoed |
//! | 7.. | request: parameters; reply: status byte, then data |

use super::bytes::{ByteWriter, EmitError};
use super::command::Command;
use super::status::Status;

/// Bytes before the register: transaction, protocol, length.
pub const HEADER_LEN: usize = 6;
/// Most bytes after the header that either side sends; the longest known
/// message has 115 (Denavit-Hartenberg table), the SDKs allow about 320.
pub const MAX_BODY_LEN: usize = 400;
/// Longest frame.
pub const MAX_FRAME_LEN: usize = HEADER_LEN + MAX_BODY_LEN;
/// Register number of a feedback push, which no request has.
pub const FEEDBACK_REGISTER: u8 = 0xFF;

/// Protocol id of a frame, by its number on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u16)]
pub enum Protocol {
    /// Standard Modbus TCP.
    Modbus = 0,
    /// The heartbeat option of the Python SDK; is never answered.
    Heartbeat = 1,
    /// The private protocol.
    Private = 2,
    /// The private protocol, firmware 1.8.6 and later.
    PrivateHeartbeat = 3,
}

impl Protocol {
    /// From the number on the wire, `None` for one that no peer sends.
    #[must_use]
    pub fn from_code(code: u16) -> Option<Self> {
        [
            Self::Modbus,
            Self::Heartbeat,
            Self::Private,
            Self::PrivateHeartbeat,
        ]
        .into_iter()
        .find(|protocol| protocol.code() == code)
    }

    /// The number on the wire.
    #[must_use]
    pub const fn code(self) -> u16 {
        self as u16
    }
}

/// One whole frame, its body not looked at yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame<'a> {
    /// Transaction id.
    pub transaction: u16,
    /// Protocol id.
    pub protocol: Protocol,
    /// Register and what follows.
    pub body: &'a [u8],
}

/// A request, its parameters still bytes; [`Command::parse`] types them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Request<'a> {
    /// Transaction id to echo.
    pub transaction: u16,
    /// Protocol id to echo.
    pub protocol: Protocol,
    /// Register number.
    pub register: u8,
    /// Parameters.
    pub parameters: &'a [u8],
}

/// A reply, its data still bytes; [`super::ReplyData::parse`] types them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reply<'a> {
    /// Transaction id of the request.
    pub transaction: u16,
    /// Protocol id of the request.
    pub protocol: Protocol,
    /// Register of the request, or [`FEEDBACK_REGISTER`].
    pub register: u8,
    /// Status byte.
    pub status: Status,
    /// Data after the status byte.
    pub data: &'a [u8],
}

impl<'a> Frame<'a> {
    /// The frame as a request; `None` when it has no register.
    #[must_use]
    pub fn as_request(&self) -> Option<Request<'a>> {
        let (register, parameters) = self.body.split_first()?;
        Some(Request {
            transaction: self.transaction,
            protocol: self.protocol,
            register: *register,
            parameters,
        })
    }

    /// The frame as a reply; `None` when register or status is missing.
    #[must_use]
    pub fn as_reply(&self) -> Option<Reply<'a>> {
        let [register, status, data @ ..] = self.body else {
            return None;
        };
        Some(Reply {
            transaction: self.transaction,
            protocol: self.protocol,
            register: *register,
            status: Status(*status),
            data,
        })
    }
}

impl Request<'_> {
    /// Writes the frame to the front of `out` and returns its length.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
        emit_frame(out, self.transaction, self.protocol, |body| {
            body.bytes(&[self.register]);
            body.bytes(self.parameters);
        })
    }
}

impl Reply<'_> {
    /// Writes the frame to the front of `out` and returns its length.
    pub fn emit(&self, out: &mut [u8]) -> Result<usize, EmitError> {
        emit_frame(out, self.transaction, self.protocol, |body| {
            body.bytes(&[self.register, self.status.0]);
            body.bytes(self.data);
        })
    }
}

/// Writes a typed request to the front of `out` and returns its length;
/// [`MAX_FRAME_LEN`] bytes are always enough. RT-safe.
pub fn emit_command(
    out: &mut [u8],
    transaction: u16,
    protocol: Protocol,
    command: &Command,
) -> Result<usize, EmitError> {
    emit_frame(out, transaction, protocol, |body| {
        body.bytes(&[command.register().code()]);
        let mut command = *command;
        command.fields(body);
    })
}

/// The transaction id after `id`: clients count 1 to 65535 and wrap to 1.
#[must_use]
pub const fn next_transaction(id: u16) -> u16 {
    match id.checked_add(1) {
        Some(next) => next,
        None => 1,
    }
}

/// Writes header and body; the length field is known only after the body.
pub(super) fn emit_frame(
    out: &mut [u8],
    transaction: u16,
    protocol: Protocol,
    body: impl FnOnce(&mut ByteWriter<'_>),
) -> Result<usize, EmitError> {
    let mut writer = ByteWriter::new(&mut *out);
    writer.bytes(&transaction.to_be_bytes());
    writer.bytes(&protocol.code().to_be_bytes());
    writer.bytes(&[0; 2]);
    body(&mut writer);
    let len = writer.finish()?;
    let body_len = u16::try_from(len.saturating_sub(HEADER_LEN)).unwrap_or(u16::MAX);
    if let Some(field) = out.get_mut(4..HEADER_LEN) {
        field.copy_from_slice(&body_len.to_be_bytes());
    }
    Ok(len)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xarm::stream::FrameReader;

    /// Bytes from the vendor's documents: enable all joints.
    #[test]
    fn vendor_example_of_motion_enable() {
        let mut out = [0; MAX_FRAME_LEN];
        let command = Command::MotionEnable {
            joint: Command::ALL_JOINTS,
            enable: true,
        };
        let n = emit_command(&mut out, 1, Protocol::Private, &command).unwrap();
        assert_eq!(out[..n], [0, 1, 0, 2, 0, 3, 0x0B, 8, 1]);

        let mut reader = FrameReader::new();
        reader.feed(&[0, 1, 0, 2, 0, 2, 0x0B, 0x10]);
        let frame = reader.next_frame().unwrap().unwrap();
        let reply = frame.as_reply().unwrap();
        assert_eq!((reply.transaction, reply.register), (1, 0x0B));
        assert_eq!((reply.status, reply.data.len()), (Status(0x10), 0));
    }

    #[test]
    fn a_short_buffer_is_refused_with_the_size_it_needs() {
        let request = Request {
            transaction: 1,
            protocol: Protocol::Private,
            register: 13,
            parameters: &[],
        };
        for given in 0..7 {
            let error = request.emit(&mut [0; 16][..given]).unwrap_err();
            let EmitError::BufferTooSmall { needed, .. } = error;
            assert!(needed > given && needed <= 7, "{error}");
        }
        assert_eq!(request.emit(&mut [0; 7]), Ok(7));
    }
}
