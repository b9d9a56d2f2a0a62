//! The guardian's own connection to the arm: opened, kept and used without ever
//! waiting.

use crate::xarm::frame::{MAX_FRAME_LEN, emit_command, next_transaction};
use crate::xarm::{Command, FrameReader, Protocol, ReplyData, StateRequest};
use socket2::{Domain, Protocol as Transport, Socket, Type};
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::net::SocketAddr;
use std::time::Duration;

/// Pause before a new attempt to connect (ns).
const RETRY_NS: u64 = 100_000_000;
/// Longest wait for a connection (ns).
const CONNECT_WITHIN_NS: u64 = 1_000_000_000;
/// How often the arm is asked for its state, so that a dead connection is
/// noticed before it is needed (ns). Keeps the heartbeat rule of the protocol
/// many times over.
const ASK_EVERY_NS: u64 = 200_000_000;
/// Age of the newest answer beyond which the arm does not count as reached (ns); a silent
/// connection is opened anew before.
const ANSWERED_WITHIN_NS: u64 = 1_000_000_000;
/// Silence after which the connection is opened anew (ns).
const SILENCE_NS: u64 = 600_000_000;
/// Unacknowledged data for this long mean a broken connection.
const USER_TIMEOUT: Duration = Duration::from_millis(1000);

#[derive(Debug)]
enum Phase {
    Down { retry_ns: u64 },
    Opening { socket: Socket, since_ns: u64 },
    Up(Box<Open>),
}

#[derive(Debug)]
struct Open {
    socket: Socket,
    reader: FrameReader,
    transaction: u16,
    /// Transaction of the newest question for the state.
    question: u16,
    requested_ns: u64,
    received_ns: u64,
    /// When the newest stop was asked for.
    stop_ns: Option<u64>,
}

/// A connection that comes back by itself.
#[derive(Debug)]
pub struct ArmLine {
    address: SocketAddr,
    phase: Phase,
    /// When the arm answered last, on whatever connection.
    answered_ns: Option<u64>,
}

impl ArmLine {
    /// To the command port at `address`; opened in the turns that follow.
    #[must_use]
    pub const fn new(address: SocketAddr) -> Self {
        Self {
            address,
            phase: Phase::Down { retry_ns: 0 },
            answered_ns: None,
        }
    }

    /// Whether commands can be sent.
    #[must_use]
    pub const fn is_connected(&self) -> bool {
        matches!(self.phase, Phase::Up(_))
    }

    /// Whether the arm answers: a connection alone proves nothing.
    #[must_use]
    pub fn is_answered(&self, now_ns: u64) -> bool {
        let within = |at_ns: u64| now_ns.saturating_sub(at_ns) < ANSWERED_WITHIN_NS;
        self.answered_ns.is_some_and(within)
    }

    /// One turn: goes on connecting, keeps the connection alive, and returns the
    /// arm's state if the answer to the newest question for it came. Never waits.
    pub fn turn(&mut self, now_ns: u64) -> Option<u8> {
        let next = match &mut self.phase {
            Phase::Down { retry_ns } if now_ns < *retry_ns => return None,
            Phase::Down { .. } => open(self.address, now_ns),
            Phase::Opening { socket, since_ns } => match is_open(socket) {
                Ok(true) => take(self.address, now_ns, socket),
                Ok(false) if now_ns.saturating_sub(*since_ns) < CONNECT_WITHIN_NS => return None,
                Ok(false) => Err(ErrorKind::TimedOut.into()),
                Err(reason) => Err(reason),
            },
            Phase::Up(open) => match open.turn(now_ns) {
                Ok(state) => {
                    self.answered_ns = state.map(|_| now_ns).or(self.answered_ns);
                    return state;
                }
                Err(reason) => Err(reason),
            },
        };
        self.phase = next.unwrap_or_else(|reason| {
            tracing::debug!(%reason, "no connection to the arm");
            Phase::Down {
                retry_ns: now_ns.saturating_add(RETRY_NS),
            }
        });
        None
    }

    /// Asks the arm to stop, then for its state; false when it could not be sent.
    /// A connection on which the last stop met with silence is not tried twice: a
    /// new one is opened in the next turns.
    pub fn ask_stop(&mut self, now_ns: u64) -> bool {
        let Phase::Up(open) = &mut self.phase else {
            return false;
        };
        if open.stop_ns.is_some_and(|at_ns| open.received_ns <= at_ns) {
            tracing::warn!("the arm does not answer on this connection; opening another");
            self.phase = Phase::Down { retry_ns: now_ns };
            return false;
        }
        let stop = Command::SetState(StateRequest::Stop);
        let sent = open.send(&stop).and_then(|_| open.ask_state(now_ns));
        open.stop_ns = Some(now_ns);
        if let Err(reason) = &sent {
            tracing::warn!(%reason, "the stop could not be sent");
            self.phase = Phase::Down { retry_ns: now_ns };
        }
        sent.is_ok()
    }
}

fn open(address: SocketAddr, now_ns: u64) -> Result<Phase> {
    let socket = Socket::new(
        Domain::for_address(address),
        Type::STREAM,
        Some(Transport::TCP),
    )?;
    socket.set_nonblocking(true)?;
    socket.set_tcp_nodelay(true)?;
    socket.set_tcp_user_timeout(Some(USER_TIMEOUT))?;
    match socket.connect(&address.into()) {
        Err(e) if e.kind() == ErrorKind::WouldBlock || in_progress(&e) => {}
        Err(e) => return Err(e),
        Ok(()) => {}
    }
    Ok(Phase::Opening {
        socket,
        since_ns: now_ns,
    })
}

fn in_progress(error: &Error) -> bool {
    error.raw_os_error() == Some(libc::EINPROGRESS)
}

/// Whether a connection under way has come up.
fn is_open(socket: &Socket) -> Result<bool> {
    match socket.take_error()? {
        Some(reason) => Err(reason),
        None => Ok(socket.peer_addr().is_ok()),
    }
}

fn take(address: SocketAddr, now_ns: u64, socket: &Socket) -> Result<Phase> {
    tracing::info!(%address, "the guardian has its own connection to the arm");
    Ok(Phase::Up(Box::new(Open {
        socket: socket.try_clone()?,
        reader: FrameReader::new(),
        transaction: 0,
        question: 0,
        requested_ns: 0,
        received_ns: now_ns,
        stop_ns: None,
    })))
}

impl Open {
    fn send(&mut self, command: &Command) -> Result<u16> {
        self.transaction = next_transaction(self.transaction);
        let mut frame = [0; MAX_FRAME_LEN];
        let protocol = Protocol::PrivateHeartbeat;
        let len =
            emit_command(&mut frame, self.transaction, protocol, command).map_err(Error::other)?;
        let frame = frame.get(..len).unwrap_or_default();
        let written = self.socket.write(frame)?;
        if written < frame.len() {
            // A few bytes that do not fit mean that nobody reads.
            return Err(ErrorKind::WriteZero.into());
        }
        Ok(self.transaction)
    }

    fn ask_state(&mut self, now_ns: u64) -> Result<()> {
        self.question = self.send(&Command::GetState)?;
        self.requested_ns = now_ns;
        Ok(())
    }

    fn turn(&mut self, now_ns: u64) -> Result<Option<u8>> {
        let state = self.receive(now_ns)?;
        if now_ns.saturating_sub(self.received_ns) > SILENCE_NS {
            return Err(ErrorKind::TimedOut.into());
        }
        if now_ns.saturating_sub(self.requested_ns) >= ASK_EVERY_NS {
            self.ask_state(now_ns)?;
        }
        Ok(state)
    }

    fn receive(&mut self, now_ns: u64) -> Result<Option<u8>> {
        match self.socket.read(self.reader.space()) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(n) => {
                self.reader.commit(n);
                self.received_ns = now_ns;
            }
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {
                return Ok(None);
            }
            Err(e) => return Err(e),
        }
        let mut state = None;
        while let Some(frame) = self.reader.next_frame().map_err(Error::other)? {
            let Some(reply) = frame.as_reply() else {
                continue;
            };
            if reply.transaction == self.question
                && let Ok(ReplyData::State(s)) = ReplyData::parse(&Command::GetState, &reply)
            {
                state = Some(s.code());
            }
        }
        Ok(state)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::xarm::{ArmState, Status};
    use std::net::{TcpListener, TcpStream};
    use std::sync::mpsc;

    const MS: u64 = 1_000_000;

    /// Answers questions for the state with `after` once a stop was asked for; tells
    /// the registers it is asked.
    pub(crate) fn serve(mut stream: TcpStream, requested: &mpsc::Sender<u8>, after: ArmState) {
        let (mut reader, mut state) = (FrameReader::new(), ArmState::Moving);
        let mut out = [0; MAX_FRAME_LEN];
        while let Ok(n @ 1..) = stream.read(reader.space()) {
            reader.commit(n);
            while let Ok(Some(frame)) = reader.next_frame() {
                let request = frame.as_request().unwrap();
                requested.send(request.register).unwrap();
                let data = match Command::parse(request.register, request.parameters).unwrap() {
                    Command::SetState(StateRequest::Stop) => {
                        state = after;
                        ReplyData::None
                    }
                    _ => ReplyData::State(state),
                };
                let n = data.emit(&mut out, &request, Status(0)).unwrap();
                stream.write_all(&out[..n]).unwrap();
            }
        }
    }

    /// Turns the line, 2 ms a turn, until `done`.
    fn until(line: &mut ArmLine, now_ns: &mut u64, done: impl Fn(&ArmLine, Option<u8>) -> bool) {
        for _ in 0..5000 {
            *now_ns += 2 * MS;
            let state = line.turn(*now_ns);
            if done(line, state) {
                return;
            }
            std::thread::sleep(Duration::from_millis(1));
        }
        panic!("never happened");
    }

    #[test]
    fn it_connects_stops_the_arm_reads_its_state_and_comes_back() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let mut line = ArmLine::new(address);
        let mut now_ns = 1_000_000_000_000;
        assert!(!line.ask_stop(now_ns), "nobody to ask yet");
        until(&mut line, &mut now_ns, |line, _| line.is_connected());
        assert!(!line.is_answered(now_ns), "nobody has answered yet");
        let (sender, requested) = mpsc::channel();
        let (first, _) = listener.accept().unwrap();
        let server = std::thread::spawn(move || {
            let far = first.try_clone().unwrap();
            serve(first, &sender, ArmState::Stopped);
            drop(far);
        });
        until(&mut line, &mut now_ns, |_, state| state == Some(1));
        assert!(line.is_answered(now_ns) && !line.is_answered(now_ns + ANSWERED_WITHIN_NS));
        assert!(line.ask_stop(now_ns));
        until(&mut line, &mut now_ns, |_, state| state == Some(4));
        assert_eq!(
            requested.try_iter().take(3).collect::<Vec<_>>(),
            [13, 12, 13]
        );

        // Answered since: the same connection serves for the next stop.
        now_ns += 100 * MS;
        assert!(line.ask_stop(now_ns));
        until(&mut line, &mut now_ns, |_, state| state == Some(4));

        // The arm goes silent: the connection is given up and opened again.
        now_ns += SILENCE_NS + MS;
        line.turn(now_ns);
        assert!(!line.is_connected());
        server.join().unwrap();
        until(&mut line, &mut now_ns, |line, _| line.is_connected());
        assert!(listener.accept().is_ok());
    }

    #[test]
    fn a_stop_that_meets_silence_goes_out_again_on_another_connection() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut line = ArmLine::new(listener.local_addr().unwrap());
        let mut now_ns = 1_000_000_000_000;
        until(&mut line, &mut now_ns, |line, _| line.is_connected());
        // Taken in by the system, read by nobody.
        let (_deaf, _) = listener.accept().unwrap();
        assert!(line.ask_stop(now_ns));
        now_ns += 100 * MS;
        assert!(!line.ask_stop(now_ns));
        until(&mut line, &mut now_ns, |line, _| line.is_connected());
        let (sender, _asked) = mpsc::channel();
        let (second, _) = listener.accept().unwrap();
        std::thread::spawn(move || serve(second, &sender, ArmState::Stopped));
        assert!(line.ask_stop(now_ns));
        until(&mut line, &mut now_ns, |_, state| state == Some(4));
    }
}
