//! The command link over TCP: one write per command, replies matched by id
//! whenever they come, never waited for.

use super::{ArmTransport, ByteWire, LinkGone, Sent};
use crate::control::LinkInput;
use crate::os::receive::{receive, stamp_arrivals};
use crate::xarm::frame::{MAX_FRAME_LEN, emit_command, next_transaction};
use crate::xarm::{Command, FrameReader, Protocol, Status};
use std::io::{ErrorKind, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Commands that may wait for their reply; at 250 Hz this is 0.25 s, longer
/// than the smallest TCP retransmission time (0.2 s) that a stall lasts.
const MAX_UNANSWERED: usize = 64;
/// Reads of one poll at most; each takes up to a buffer of replies.
const MAX_READS: usize = 4;
/// Unacknowledged data for this long mean a broken connection.
const USER_TIMEOUT: Duration = Duration::from_millis(1000);

/// A connected, non-blocking command link, usually over a socket.
#[derive(Debug)]
pub struct TcpLink<W = TcpStream> {
    stream: W,
    reader: FrameReader,
    transaction: u16,
    unanswered: heapless::Deque<(u16, u64), MAX_UNANSWERED>,
    /// Rest of a frame that the socket took only in part.
    rest: heapless::Vec<u8, MAX_FRAME_LEN>,
}

impl ByteWire for TcpStream {
    fn receive(&mut self, into: &mut [u8]) -> std::io::Result<(usize, Option<u64>)> {
        receive(self, into)
    }

    fn send(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.write(bytes)
    }
}

impl TcpLink {
    /// Connects to `address`. Blocks up to `timeout`; not RT-safe.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn connect(address: SocketAddr, timeout: Duration) -> std::io::Result<Self> {
        let stream = TcpStream::connect_timeout(&address, timeout)?;
        let socket = socket2::SockRef::from(&stream);
        socket.set_tcp_nodelay(true)?;
        socket.set_tcp_quickack(true)?;
        socket.set_tcp_user_timeout(Some(USER_TIMEOUT))?;
        stream.set_nonblocking(true)?;
        // Without stamps a round trip is rounded up to the next look, no more.
        let _ = stamp_arrivals(&stream);
        Ok(Self::over(stream))
    }
}

impl<W: ByteWire> TcpLink<W> {
    /// A link over a connected wire. Not RT-safe.
    #[must_use]
    pub fn over(stream: W) -> Self {
        Self {
            stream,
            reader: FrameReader::new(),
            transaction: 1,
            unanswered: heapless::Deque::new(),
            rest: heapless::Vec::new(),
        }
    }

    /// Writes what is left of the last frame; true when nothing is.
    fn flush_rest(&mut self) -> Result<bool, LinkGone> {
        while !self.rest.is_empty() {
            match write_once(&mut self.stream, &self.rest)? {
                0 => return Ok(false),
                n => {
                    let left = heapless::Vec::from_slice(self.rest.get(n..).unwrap_or_default());
                    self.rest = left.unwrap_or_default();
                }
            }
        }
        Ok(true)
    }

    /// Takes whole replies out of the reader; they came at `came_ns`.
    fn take_replies(&mut self, came_ns: u64, seen: &mut LinkInput) -> Result<(), LinkGone> {
        loop {
            let frame = match self.reader.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => return Ok(()),
                Err(_broken) => return Err(LinkGone),
            };
            let Some(reply) = frame.as_reply() else {
                continue;
            };
            let known = self
                .unanswered
                .iter()
                .any(|(id, _)| *id == reply.transaction);
            if !known {
                continue;
            }
            // The arm answers in order: commands before this one got no reply.
            while let Some((id, sent_ns)) = self.unanswered.pop_front() {
                if id == reply.transaction {
                    let trip_ns = came_ns.saturating_sub(sent_ns);
                    seen.reply_ns = u32::try_from(trip_ns).unwrap_or(u32::MAX);
                    break;
                }
            }
            let before = seen.status.map_or(0, |s| s.0);
            seen.status = Some(Status(before | reply.status.0));
        }
    }

    fn receive(&mut self, now_ns: u64, seen: &mut LinkInput) -> Result<(), LinkGone> {
        for _ in 0..MAX_READS {
            match self.stream.receive(self.reader.space()) {
                Ok((0, _)) => return Err(LinkGone),
                Ok((n, arrival_ns)) => {
                    self.reader.commit(n);
                    let came_ns = arrival_ns.map_or(now_ns, |arrival_ns| arrival_ns.min(now_ns));
                    self.take_replies(came_ns, seen)?;
                }
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(_gone) => return Err(LinkGone),
            }
        }
        Ok(())
    }
}

/// Bytes the socket took; 0 when it would have had to wait.
fn write_once(stream: &mut impl ByteWire, bytes: &[u8]) -> Result<usize, LinkGone> {
    match stream.send(bytes) {
        Ok(0) => Err(LinkGone),
        Ok(n) => Ok(n),
        Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
        Err(_gone) => Err(LinkGone),
    }
}

impl<W: ByteWire> ArmTransport for TcpLink<W> {
    fn send(&mut self, command: &Command, now_ns: u64) -> Result<Sent, LinkGone> {
        if !self.flush_rest()? || self.unanswered.is_full() {
            return Ok(Sent::Skipped);
        }
        let mut frame = [0; MAX_FRAME_LEN];
        let Ok(len) = emit_command(&mut frame, self.transaction, Protocol::Private, command) else {
            return Ok(Sent::Skipped);
        };
        let frame = frame.get(..len).unwrap_or_default();
        let written = write_once(&mut self.stream, frame)?;
        if written == 0 {
            return Ok(Sent::Skipped);
        }
        self.rest =
            heapless::Vec::from_slice(frame.get(written..).unwrap_or_default()).unwrap_or_default();
        let _ = self.unanswered.push_back((self.transaction, now_ns));
        self.transaction = next_transaction(self.transaction);
        Ok(Sent::Whole)
    }

    fn poll(&mut self, now_ns: u64) -> LinkInput {
        let mut seen = LinkInput::default();
        seen.lost = self.receive(now_ns, &mut seen).is_err();
        seen.unanswered_ns = self
            .unanswered
            .front()
            .map_or(0, |(_, sent_ns)| now_ns.saturating_sub(*sent_ns));
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::xarm::{ReplyData, StateRequest};
    use shared_types::JointVector;
    use std::io::Read;
    use std::net::TcpListener;

    fn pair() -> (TcpLink, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let link = TcpLink::connect(address, Duration::from_secs(1)).unwrap();
        let (peer, _) = listener.accept().unwrap();
        peer.set_nodelay(true).unwrap();
        (link, peer)
    }

    /// Reads `count` requests and returns their replies, in order.
    fn replies(peer: &mut TcpStream, count: usize, status: Status) -> Vec<Vec<u8>> {
        let mut reader = FrameReader::new();
        let mut out = Vec::new();
        while out.len() < count {
            let n = peer.read(reader.space()).unwrap();
            reader.commit(n);
            while let Some(frame) = reader.next_frame().unwrap() {
                let request = frame.as_request().unwrap();
                let mut bytes = [0; MAX_FRAME_LEN];
                let n = ReplyData::None.emit(&mut bytes, &request, status).unwrap();
                out.push(bytes[..n].to_vec());
            }
        }
        out
    }

    fn poll_until(link: &mut TcpLink, now_ns: u64, done: impl Fn(&LinkInput) -> bool) -> LinkInput {
        for _ in 0..2000 {
            let seen = link.poll(now_ns);
            if done(&seen) {
                return seen;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        panic!("nothing came");
    }

    #[test]
    fn late_replies_are_matched_by_id_and_status_bits_add_up() {
        let (mut link, mut peer) = pair();
        let setpoint = Command::ServoJoint(JointVector::splat(0.1));
        for k in 0..3 {
            assert_eq!(link.send(&setpoint, 1000 * k), Ok(Sent::Whole));
        }
        assert_eq!(link.poll(5000).unanswered_ns, 5000);
        let mut answers = replies(&mut peer, 3, Status(0));
        answers[1][7] = Status::WARNING;
        // The second one overtakes the first, which then counts as unanswered for good.
        peer.write_all(&answers[1]).unwrap();
        let seen = poll_until(&mut link, 7000, |s| s.status.is_some());
        assert_eq!((seen.reply_ns, seen.unanswered_ns), (6000, 5000));
        assert!(seen.status.unwrap().has_warning());
        peer.write_all(&answers[0]).unwrap();
        peer.write_all(&answers[2]).unwrap();
        let seen = poll_until(&mut link, 9000, |s| s.status.is_some());
        assert_eq!((seen.reply_ns, seen.unanswered_ns), (7000, 0));
    }

    #[test]
    fn a_silent_arm_gets_no_endless_queue_and_a_closed_one_is_noticed() {
        let (mut link, peer) = pair();
        let stop = Command::SetState(StateRequest::Stop);
        for _ in 0..MAX_UNANSWERED {
            assert_eq!(link.send(&stop, 0), Ok(Sent::Whole));
        }
        assert_eq!(link.send(&stop, 0), Ok(Sent::Skipped));
        drop(peer);
        assert!(poll_until(&mut link, 1, |s| s.lost).lost);
    }

    #[test]
    fn garbage_breaks_the_link() {
        let (mut link, mut peer) = pair();
        peer.write_all(&[0xFF; 32]).unwrap();
        assert!(poll_until(&mut link, 1, |s| s.lost).lost);
    }
}
