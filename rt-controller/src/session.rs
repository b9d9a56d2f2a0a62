//! The set-up connection: requests that wait for their answer.
//!
//! Bring-up, recovery and questions about errors need replies in order and may
//! take their time. They run in the bridge thread, on a connection of their own
//! (the arm serves several clients), so that the control loop's link carries
//! setpoints only.

use crate::guardian::decision::{ASK_EVERY_NS, STOP_WITHIN_NS};
use crate::xarm::frame::{MAX_FRAME_LEN, emit_command, next_transaction};
use crate::xarm::version::SIMULATED_SERIAL_NUMBER;
use crate::xarm::{
    ArmState, BrokenStream, Command, ErrorCode, FrameReader, Protocol, ReplyData, ReplyError,
    StateRequest,
};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// What is left when no stop gets through.
const PRESS: &str = "press its emergency stop";
/// Longest wait for the answer to a stop.
const STOP_TIMEOUT: Duration = Duration::from_millis(200);

/// Why a question was not answered.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// No connection.
    #[error("cannot connect to the arm at {0} ({1}): check power, cable, address and port")]
    Connect(SocketAddr, std::io::Error),
    /// The connection failed on the way.
    #[error("the arm did not answer {0:?} ({1}): check the cable and try again")]
    Transfer(Box<Command>, std::io::Error),
    /// The stream makes no sense.
    #[error("the arm's answers make no sense: {0}; is this the command port?")]
    Broken(#[from] BrokenStream),
    /// An answer makes no sense.
    #[error("the arm answered wrongly: {0}")]
    Reply(#[from] ReplyError),
}

/// A connection for questions. Blocks; not RT-safe.
#[derive(Debug)]
pub struct ArmSession {
    address: SocketAddr,
    stream: TcpStream,
    reader: FrameReader,
    transaction: u16,
    protocol: Protocol,
    timeout: Duration,
}

impl ArmSession {
    /// Connects; every later answer is waited for at most `timeout`.
    ///
    /// # Errors
    /// [`SessionError::Connect`].
    pub fn connect(address: SocketAddr, timeout: Duration) -> Result<Self, SessionError> {
        let open = || {
            let stream = TcpStream::connect_timeout(&address, timeout)?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(timeout))?;
            stream.set_write_timeout(Some(timeout))?;
            Ok(stream)
        };
        Ok(Self {
            address,
            stream: open().map_err(|reason| SessionError::Connect(address, reason))?,
            reader: FrameReader::new(),
            transaction: 0,
            protocol: Protocol::Private,
            timeout,
        })
    }

    /// Changes to protocol 3 for every later request, as clients of firmware
    /// 1.8.6 and newer do; nothing announces it. A session is over long before
    /// the protocol's heartbeat would be due.
    pub fn keep_heartbeat(&mut self) {
        self.protocol = Protocol::PrivateHeartbeat;
    }

    /// Sends a request and waits for its answer; others are skipped.
    ///
    /// # Errors
    /// [`SessionError`]; after one, open a new session.
    pub fn ask(&mut self, command: &Command) -> Result<ReplyData, SessionError> {
        let fail = |reason| SessionError::Transfer(Box::new(*command), reason);
        self.transaction = next_transaction(self.transaction);
        let mut frame = [0; MAX_FRAME_LEN];
        let len = emit_command(&mut frame, self.transaction, self.protocol, command)
            .map_err(|e| fail(std::io::Error::other(e)))?;
        let frame = frame.get(..len).unwrap_or_default();
        self.stream.write_all(frame).map_err(fail)?;
        let began = Instant::now();
        loop {
            while let Some(frame) = self.reader.next_frame()? {
                if let Some(reply) = frame.as_reply()
                    && reply.transaction == self.transaction
                {
                    return Ok(ReplyData::parse(command, &reply)?);
                }
            }
            if began.elapsed() > self.timeout {
                return Err(fail(std::io::ErrorKind::TimedOut.into()));
            }
            match self.stream.read(self.reader.space()).map_err(fail)? {
                0 => return Err(fail(std::io::ErrorKind::UnexpectedEof.into())),
                n => self.reader.commit(n),
            }
        }
    }

    /// Address of the arm.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Whether the arm proves by its serial number that it is the simulated one.
    pub fn proves_simulated(&mut self) -> Result<bool, SessionError> {
        Ok(match self.ask(&Command::SerialNumbers)? {
            ReplyData::Text(text) => text.as_str() == SIMULATED_SERIAL_NUMBER,
            _ => false,
        })
    }

    /// Levels of the control box's digital inputs, bit `i` of input `i`.
    pub fn digital_inputs(&mut self) -> Result<u16, SessionError> {
        match self.ask(&Command::DigitalInputs)? {
            ReplyData::DigitalInputs(levels) => Ok(levels),
            _ => Err(ReplyError::Invalid(Command::DigitalInputs.register().code()).into()),
        }
    }

    /// State of the arm.
    pub fn state(&mut self) -> Result<ArmState, SessionError> {
        match self.ask(&Command::GetState)? {
            ReplyData::State(state) => Ok(state),
            _ => Ok(ArmState::Other(0)),
        }
    }

    /// Error code of the arm.
    pub fn error_code(&mut self) -> Result<ErrorCode, SessionError> {
        match self.ask(&Command::GetFault)? {
            ReplyData::Fault { error, .. } => Ok(ErrorCode(error)),
            _ => Ok(ErrorCode::NONE),
        }
    }

    /// Asks the arm to stop by itself; whether it says that it has.
    pub fn stop_arm(&mut self) -> Result<bool, SessionError> {
        self.ask(&Command::SetState(StateRequest::Stop))?;
        let state = self.state()?;
        Ok(matches!(state, ArmState::Stopped | ArmState::NeedsReset))
    }
}

/// Asks the arm to stop until it says that it has, on a new connection each time, as the
/// vendor's own SDK repeats it; gives up after 3 s and says so.
pub fn stop_until_confirmed(command_port: SocketAddr) {
    let within = Duration::from_nanos(STOP_WITHIN_NS);
    let began = Instant::now();
    loop {
        let stopped =
            ArmSession::connect(command_port, STOP_TIMEOUT).and_then(|mut s| s.stop_arm());
        match stopped {
            Ok(true) => return tracing::info!("the arm says that it has stopped"),
            _ if began.elapsed() < within => {
                std::thread::sleep(Duration::from_nanos(ASK_EVERY_NS));
            }
            Ok(false) => {
                return tracing::error!(
                    "the arm was asked to stop for 3 s but still moves: {PRESS}"
                );
            }
            Err(reason) => {
                return tracing::error!(%reason, "no stop could be confirmed for 3 s: {PRESS}");
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guardian::line::tests::serve;
    use std::net::TcpListener;
    use std::sync::mpsc;

    #[test]
    fn a_stop_is_repeated_until_the_arm_says_that_it_has_stopped() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let (sender, requested) = mpsc::channel();
        let arm = std::thread::spawn(move || {
            for after in [ArmState::Moving, ArmState::Moving, ArmState::Stopped] {
                let (stream, _) = listener.accept().unwrap();
                serve(stream, &sender, after);
            }
        });
        stop_until_confirmed(address);
        arm.join().unwrap();
        // The stop, then the question for the state.
        assert_eq!(requested.iter().collect::<Vec<_>>(), [12, 13].repeat(3));
    }
}
