//! Reassembles frames from a TCP stream: split frames are joined, merged ones
//! split.
//!
//! The protocol has no start mark, so a stream that shows an impossible header
//! has lost its place for good: the reader reports [`BrokenStream`] and stays
//! broken until [`StreamReader::reset`]; the owner drops the connection.

use super::frame::{Frame, HEADER_LEN, MAX_BODY_LEN, Protocol};
use core::marker::PhantomData;

/// Bytes a reader holds; several frames of any kind.
pub const STREAM_CAPACITY: usize = 2048;

/// A header that no peer sends: the place in the stream is lost, close the
/// connection and open a new one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BrokenStream {
    /// Protocol id outside 0 to 3.
    #[error("frame with protocol id {0}, known are 0 to 3; drop the connection")]
    Protocol(u16),
    /// Body length zero or above [`MAX_BODY_LEN`].
    #[error(
        "frame with a body of {0} bytes, possible are 1 to {MAX_BODY_LEN}; drop the connection"
    )]
    Length(u16),
    /// Report size outside what the controller sends.
    #[error("report of {0} bytes, possible are 87 to 1024; drop the connection")]
    ReportSize(u32),
}

/// Where a kind of stream cuts its frames.
pub trait Framing {
    /// Length of the first frame of `pending` with its header (bytes), `None`
    /// while too little is there to tell.
    ///
    /// # Errors
    /// [`BrokenStream`] for a header that no peer sends.
    fn frame_len(pending: &[u8]) -> Result<Option<usize>, BrokenStream>;
}

/// Fixed buffer between a socket and a parser, which cuts a stream into frames. RT-safe.
///
/// Receive into [`space`](Self::space), [`commit`](Self::commit) the count,
/// then call [`FrameReader::next_frame`] or [`ReportReader::next_report`] until
/// it returns `None`.
#[derive(Debug, Clone)]
pub struct StreamReader<K> {
    bytes: [u8; STREAM_CAPACITY],
    start: usize,
    end: usize,
    kind: PhantomData<K>,
}

impl<K> Default for StreamReader<K> {
    fn default() -> Self {
        Self::new()
    }
}

impl<K> StreamReader<K> {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [0; STREAM_CAPACITY],
            start: 0,
            end: 0,
            kind: PhantomData,
        }
    }

    /// Room for received bytes, behind the pending ones, which move to the front
    /// first. Never empty once all whole frames were taken, since the longest frame
    /// is shorter than the buffer.
    pub fn space(&mut self) -> &mut [u8] {
        if self.start > 0 {
            self.bytes.copy_within(self.start..self.end, 0);
            self.end = self.end.saturating_sub(self.start);
            self.start = 0;
        }
        self.bytes.get_mut(self.end..).unwrap_or_default()
    }

    /// Says how many bytes were received into [`space`](Self::space).
    pub fn commit(&mut self, received: usize) {
        self.end = self.end.saturating_add(received).min(STREAM_CAPACITY);
    }

    /// Copies `bytes` in and returns how many fitted.
    pub fn feed(&mut self, bytes: &[u8]) -> usize {
        let room = self.space().iter_mut().zip(bytes);
        let taken = room.map(|(to, from)| *to = *from).count();
        self.commit(taken);
        taken
    }

    /// Forgets everything, for a new connection.
    pub fn reset(&mut self) {
        (self.start, self.end) = (0, 0);
    }

    /// Whether every byte received has been taken.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.pending().is_empty()
    }

    fn pending(&self) -> &[u8] {
        self.bytes.get(self.start..self.end).unwrap_or_default()
    }
}

impl<K: Framing> StreamReader<K> {
    /// The next whole frame with its header. A bad header stays in front, so
    /// that the stream stays broken.
    fn next_bytes(&mut self) -> Result<Option<&[u8]>, BrokenStream> {
        let Some(len) = K::frame_len(self.pending())? else {
            return Ok(None);
        };
        let from = self.start;
        let to = from.saturating_add(len);
        if to > self.end {
            return Ok(None);
        }
        self.start = to;
        Ok(self.bytes.get(from..to))
    }
}

/// Frames of the command port, requests and replies alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandFraming;

/// Reads command frames, requests and replies alike, from a stream. RT-safe.
pub type FrameReader = StreamReader<CommandFraming>;

impl Framing for CommandFraming {
    fn frame_len(pending: &[u8]) -> Result<Option<usize>, BrokenStream> {
        Ok(header(pending)?.map(|(_, _, body_len)| HEADER_LEN.saturating_add(body_len)))
    }
}

impl FrameReader {
    /// The next whole frame, `None` if more bytes are needed.
    ///
    /// # Errors
    /// [`BrokenStream`] on an impossible header, and from then on until `reset`.
    pub fn next_frame(&mut self) -> Result<Option<Frame<'_>>, BrokenStream> {
        let Some(frame) = self.next_bytes()? else {
            return Ok(None);
        };
        Ok(header(frame)?.map(|(transaction, protocol, _)| Frame {
            transaction,
            protocol,
            body: frame.get(HEADER_LEN..).unwrap_or_default(),
        }))
    }
}

/// Reports, which begin with their own size.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReportFraming;

/// Reads report frames from a stream. RT-safe.
pub type ReportReader = StreamReader<ReportFraming>;

impl Framing for ReportFraming {
    fn frame_len(pending: &[u8]) -> Result<Option<usize>, BrokenStream> {
        let Some(size) = pending.first_chunk() else {
            return Ok(None);
        };
        let size = u32::from_be_bytes(*size);
        match usize::try_from(size) {
            Ok(len @ 87..=1024) => Ok(Some(len)),
            _ => Err(BrokenStream::ReportSize(size)),
        }
    }
}

impl ReportReader {
    /// Whether what has come behind the next report looks like another one;
    /// true while too little has come to tell.
    #[must_use]
    pub fn is_followed_by_a_report(&self) -> bool {
        let pending = self.pending();
        let Ok(Some(len)) = ReportFraming::frame_len(pending) else {
            return true;
        };
        let behind = pending.get(len..).unwrap_or_default();
        ReportFraming::frame_len(behind).is_ok()
    }

    /// The next whole report with its size field, `None` if more bytes are
    /// needed.
    ///
    /// # Errors
    /// [`BrokenStream::ReportSize`], and from then on until `reset`.
    pub fn next_report(&mut self) -> Result<Option<&[u8]>, BrokenStream> {
        self.next_bytes()
    }
}

/// Transaction, protocol and length of the body (bytes) from the header that `bytes` begin
/// with, `None` while it is not whole.
fn header(bytes: &[u8]) -> Result<Option<(u16, Protocol, usize)>, BrokenStream> {
    let [t0, t1, p0, p1, l0, l1, ..] = *bytes else {
        return Ok(None);
    };
    let code = u16::from_be_bytes([p0, p1]);
    let protocol = Protocol::from_code(code).ok_or(BrokenStream::Protocol(code))?;
    let length = u16::from_be_bytes([l0, l1]);
    let body_len = usize::from(length);
    if !(1..=MAX_BODY_LEN).contains(&body_len) {
        return Err(BrokenStream::Length(length));
    }
    Ok(Some((u16::from_be_bytes([t0, t1]), protocol, body_len)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xarm::frame::Request;
    use proptest::prelude::*;

    type Owned = (u16, u8, Vec<u8>);

    fn encode(frames: &[Owned]) -> Vec<u8> {
        let mut stream = Vec::new();
        for (transaction, register, parameters) in frames {
            let mut out = [0; 512];
            let n = Request {
                transaction: *transaction,
                protocol: Protocol::Private,
                register: *register,
                parameters,
            }
            .emit(&mut out)
            .unwrap();
            stream.extend_from_slice(&out[..n]);
        }
        stream
    }

    proptest! {
        #[test]
        fn any_cut_of_the_stream_gives_the_same_frames(
            frames in prop::collection::vec((any::<u16>(), any::<u8>(), prop::collection::vec(any::<u8>(), 0..90)), 1..12),
            cuts in prop::collection::vec(1_usize..64, 1..40),
        ) {
            let stream = encode(&frames);
            let mut reader = FrameReader::new();
            let mut got: Vec<Owned> = Vec::new();
            let mut at = 0;
            for cut in cuts.iter().cycle() {
                let end = (at + cut).min(stream.len());
                prop_assert_eq!(reader.feed(&stream[at..end]), end - at);
                at = end;
                while let Some(frame) = reader.next_frame().unwrap() {
                    let r = frame.as_request().unwrap();
                    got.push((r.transaction, r.register, r.parameters.to_vec()));
                }
                if at == stream.len() {
                    break;
                }
            }
            prop_assert_eq!(got, frames);
        }
    }

    #[test]
    fn heartbeat_of_the_sdk_is_a_frame_of_its_own() {
        let mut reader = FrameReader::new();
        reader.feed(&[0, 0, 0, 1, 0, 2, 0, 0, 0, 5, 0, 2, 0, 1, 13]);
        let heartbeat = reader.next_frame().unwrap().unwrap();
        assert_eq!(heartbeat.protocol, Protocol::Heartbeat);
        let request = reader.next_frame().unwrap().unwrap().as_request().unwrap();
        assert_eq!((request.transaction, request.register), (5, 13));
    }

    #[test]
    fn an_impossible_header_breaks_the_stream_until_reset() {
        let mut reader = FrameReader::new();
        reader.feed(&[0, 1, 0, 9, 0, 1, 13]);
        assert_eq!(reader.next_frame(), Err(BrokenStream::Protocol(9)));
        reader.feed(&[0, 1, 0, 2, 0, 1, 13]);
        assert_eq!(reader.next_frame(), Err(BrokenStream::Protocol(9)));
        reader.reset();
        reader.feed(&[0, 1, 0, 2, 0, 0]);
        assert_eq!(reader.next_frame(), Err(BrokenStream::Length(0)));
    }
}
