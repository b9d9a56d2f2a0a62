//! The command link over TCP: one write and one read per cycle at most, replies
//! matched by id whenever they come, never waited for.
//!
//! Commands are never bunched: a setpoint too soon after the last one, or one
//! on top of too many unanswered ones, is left out, and so is one behind the
//! rest of a frame that the network took only in part. Each is counted.

use super::heartbeat::{Heartbeat, Silence};
use super::in_flight::{InFlight, Matched};
use super::{ArmTransport, ByteStream, LinkGone, MAX_COMMANDS};
use crate::control::LinkInput;
use crate::os::receive::{receive, stamp_arrivals};
use crate::xarm::frame::{MAX_FRAME_LEN, emit_command, next_transaction};
use crate::xarm::{Command, FrameReader, Protocol, Status};
use std::io::{ErrorKind, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;

/// Bytes that one write may hold: the rest of a frame and those of one cycle.
const WRITE_LEN: usize = 1024;
/// Unacknowledged data for this long mean a broken connection.
const USER_TIMEOUT: Duration = Duration::from_millis(1000);

/// How a link treats an arm that is slow to answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LinkSettings {
    /// Setpoints that may wait for their reply; no more are sent meanwhile, so
    /// that a stall cannot end in a burst.
    pub max_unanswered: u16,
    /// Shortest time between two setpoints (ns).
    pub min_gap_ns: u64,
}

impl LinkSettings {
    /// For setpoints every `period_ns`: never closer than 0.8 of that.
    #[must_use]
    pub const fn new(max_unanswered: u16, period_ns: u64) -> Self {
        Self {
            max_unanswered,
            min_gap_ns: crate::overrun::min_gap_ns(period_ns),
        }
    }
}

/// A connected, non-blocking command link, usually over a socket.
#[derive(Debug)]
pub struct TcpLink<W = TcpStream> {
    stream: W,
    reader: FrameReader,
    settings: LinkSettings,
    in_flight: InFlight,
    heartbeat: Heartbeat,
    setpoint_ns: Option<u64>,
    skipped: u16,
    /// The arm was silent for long and is to be asked for a sign of life.
    ask: bool,
    /// Rest of a frame that the socket took only in part.
    rest: heapless::Vec<u8, WRITE_LEN>,
}

/// A frame that waits for its write.
#[derive(Debug, Clone, Copy)]
struct Written {
    begin: usize,
    end: usize,
    is_setpoint: bool,
}

impl ByteStream for TcpStream {
    fn receive(&mut self, into: &mut [u8]) -> std::io::Result<(usize, Option<u64>)> {
        receive(self, into)
    }

    fn send(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.write(bytes)
    }
}

impl TcpLink {
    /// Connects to `address`. Blocks up to `timeout`; not RT-safe.
    pub fn connect(
        address: SocketAddr,
        timeout: Duration,
        settings: LinkSettings,
    ) -> std::io::Result<Self> {
        let stream = TcpStream::connect_timeout(&address, timeout)?;
        let socket = socket2::SockRef::from(&stream);
        socket.set_tcp_nodelay(true)?;
        socket.set_tcp_quickack(true)?;
        socket.set_tcp_user_timeout(Some(USER_TIMEOUT))?;
        stream.set_nonblocking(true)?;
        // Without stamps a round trip is rounded up to the next look, no more.
        let _ = stamp_arrivals(&stream);
        Ok(Self::over(stream, settings))
    }
}

impl<W: ByteStream> TcpLink<W> {
    /// A link over a connected wire. Not RT-safe.
    #[must_use]
    pub fn over(stream: W, settings: LinkSettings) -> Self {
        Self {
            stream,
            reader: FrameReader::new(),
            settings,
            in_flight: InFlight::default(),
            heartbeat: Heartbeat::default(),
            setpoint_ns: None,
            skipped: 0,
            ask: false,
            rest: heapless::Vec::new(),
        }
    }

    /// Appends the frame of `command` with transaction `id` to what is to be
    /// written; `None` if it may not go out now or has no room.
    fn append(&mut self, command: &Command, id: u16, allowed: bool) -> Option<Written> {
        if !allowed {
            return None;
        }
        let mut frame = [0; MAX_FRAME_LEN];
        let len = emit_command(&mut frame, id, Protocol::PrivateHeartbeat, command).ok()?;
        let begin = self.rest.len();
        self.rest.extend_from_slice(frame.get(..len)?).ok()?;
        Some(Written {
            begin,
            end: self.rest.len(),
            is_setpoint: command.is_setpoint(),
        })
    }

    /// Writes `rest` and the frames behind it, once; a frame of which nothing was
    /// taken is left out.
    fn write(&mut self, frames: &[Written], now_ns: u64) -> Result<(), LinkGone> {
        if self.rest.is_empty() {
            return Ok(());
        }
        let written = write_once(&mut self.stream, &self.rest)?;
        let mut keep = frames.first().map_or(self.rest.len(), |first| first.begin);
        for frame in frames {
            if written > frame.begin {
                keep = frame.end;
                self.in_flight.sent(now_ns);
                if frame.is_setpoint {
                    self.setpoint_ns = Some(now_ns);
                }
            } else {
                self.skip();
            }
        }
        let left = self.rest.get(written..keep).unwrap_or_default();
        self.rest = heapless::Vec::from_slice(left).unwrap_or_default();
        Ok(())
    }

    /// Whether a setpoint may go out now.
    fn has_room(&self, now_ns: u64) -> bool {
        let spaced = self
            .setpoint_ns
            .is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= self.settings.min_gap_ns);
        spaced && self.in_flight.open() < self.settings.max_unanswered
    }

    fn skip(&mut self) {
        self.skipped = self.skipped.saturating_add(1);
    }

    /// Takes whole replies out of the reader; they came at `came_ns`.
    fn take_replies(&mut self, came_ns: u64, seen: &mut LinkInput) -> Result<(), LinkGone> {
        loop {
            let frame = match self.reader.next_frame() {
                Ok(Some(frame)) => frame,
                Ok(None) => return Ok(()),
                Err(_broken) => return Err(LinkGone),
            };
            // Feedback pushes and the like are nobody's reply.
            let Some(reply) = frame.as_reply() else {
                continue;
            };
            let count = |n: u16| n.saturating_add(1);
            let sent_ns = match self.in_flight.reply(reply.transaction) {
                Matched::InOrder { sent_ns } => sent_ns,
                Matched::OutOfOrder { sent_ns } => {
                    seen.out_of_order = count(seen.out_of_order);
                    sent_ns
                }
                Matched::Duplicate => {
                    seen.duplicates = count(seen.duplicates);
                    continue;
                }
                Matched::Foreign => {
                    seen.foreign = count(seen.foreign);
                    continue;
                }
            };
            let trip_ns = came_ns.saturating_sub(sent_ns);
            seen.reply_ns = u32::try_from(trip_ns).unwrap_or(u32::MAX);
            let before = seen.status.map_or(0, |s| s.0);
            seen.status = Some(Status(before | reply.status.0));
        }
    }

    /// One read, into room for two hundred replies; should there ever be more,
    /// the next cycle takes them.
    fn receive(&mut self, now_ns: u64, seen: &mut LinkInput) -> Result<(), LinkGone> {
        match self.stream.receive(self.reader.space()) {
            Ok((0, _)) => Err(LinkGone),
            Ok((n, arrival_ns)) => {
                self.reader.commit(n);
                self.heartbeat.received(now_ns);
                let came_ns = arrival_ns.map_or(now_ns, |arrival_ns| arrival_ns.min(now_ns));
                self.take_replies(came_ns, seen)
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(()),
            Err(_gone) => Err(LinkGone),
        }
    }

    /// Keeps the heartbeat rule of the protocol.
    fn keep_alive(&mut self, now_ns: u64) -> Result<(), LinkGone> {
        match self.heartbeat.due(now_ns) {
            Silence::Fine => Ok(()),
            Silence::Ask => {
                self.ask = true;
                Ok(())
            }
            Silence::GiveUp => Err(LinkGone),
        }
    }
}

/// Bytes the socket took; 0 when it would have had to wait.
fn write_once(stream: &mut impl ByteStream, bytes: &[u8]) -> Result<usize, LinkGone> {
    match stream.send(bytes) {
        Ok(0) => Err(LinkGone),
        Ok(n) => Ok(n),
        Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
        Err(_gone) => Err(LinkGone),
    }
}

impl<W: ByteStream> ArmTransport for TcpLink<W> {
    fn send(&mut self, commands: &[Command], now_ns: u64) -> Result<(), LinkGone> {
        let clear = self.rest.is_empty();
        let mut frames: heapless::Vec<Written, MAX_COMMANDS> = heapless::Vec::new();
        let mut id = self.in_flight.next_id();
        // Any command is a question, too.
        let requested = core::mem::take(&mut self.ask) && commands.is_empty();
        let question = requested.then_some(&Command::GetState);
        for command in commands.iter().chain(question) {
            let allowed = !command.is_setpoint() || (clear && self.has_room(now_ns));
            let appended = self
                .append(command, id, allowed)
                .is_some_and(|frame| frames.push(frame).is_ok());
            if appended {
                id = next_transaction(id);
            } else {
                self.skip();
            }
        }
        self.write(&frames, now_ns)
    }

    fn poll(&mut self, now_ns: u64) -> LinkInput {
        let mut seen = LinkInput {
            skipped: core::mem::take(&mut self.skipped),
            ..LinkInput::default()
        };
        let received = self.receive(now_ns, &mut seen);
        seen.lost = received.and_then(|()| self.keep_alive(now_ns)).is_err();
        seen.unanswered = self.in_flight.open();
        seen.unanswered_ns = self
            .in_flight
            .oldest_ns()
            .map_or(0, |sent_ns| now_ns.saturating_sub(sent_ns));
        seen
    }
}

#[cfg(test)]
#[path = "tcp_tests.rs"]
mod tests;
