//! The set-up connection: requests that wait for their answer.
//!
//! Bring-up, recovery and questions about errors need replies in order and may
//! take their time. They run in the relay thread, on a connection of their own
//! (the arm serves several clients), so that the control loop's link carries
//! setpoints only.

use crate::xarm::frame::{MAX_FRAME_LEN, emit_command, next_transaction};
use crate::xarm::{
    ArmState, BrokenStream, Command, ErrorCode, FrameReader, JointQuery, Mode, Protocol, ReplyData,
    ReplyError, StateRequest,
};
use shared_types::{JointVector, Limits};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::{Duration, Instant};

/// The arm checks tool speed against this times its factor (m/s).
const SPEED_AT_FACTOR_ONE_M_S: f64 = 1.0;
/// The arm stands when two poses read this far apart in time ...
const STILL_INTERVAL: Duration = Duration::from_millis(30);
/// ... differ less than this (rad).
const STILL_RAD: f64 = 1e-4;
/// Longest wait for the arm to become ready and to stand still.
const READY_TIMEOUT: Duration = Duration::from_secs(3);

/// Why the arm could not be set up.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// No connection.
    #[error(
        "cannot connect to the arm at {address} ({reason}): check power, cable, address and port"
    )]
    Connect {
        /// Address tried.
        address: SocketAddr,
        /// What the system said.
        reason: std::io::Error,
    },
    /// The connection failed on the way.
    #[error("the arm did not answer {command:?} ({reason}): check the cable and try again")]
    Transfer {
        /// Request.
        command: Box<Command>,
        /// What the system said.
        reason: std::io::Error,
    },
    /// The stream makes no sense.
    #[error("the arm's answers make no sense: {0}; is this the command port?")]
    Broken(#[from] BrokenStream),
    /// An answer makes no sense.
    #[error("the arm answered wrongly: {0}")]
    Reply(#[from] ReplyError),
    /// An error that clearing does not remove.
    #[error("the arm keeps its error {0}")]
    Error(ErrorCode),
    /// The arm does not become ready.
    #[error(
        "the arm does not become ready (state {state:?}): release its emergency stop, or use the vendor's tool to see why"
    )]
    NotReady {
        /// State it stays in.
        state: ArmState,
    },
    /// The arm moves by itself.
    #[error("the arm does not stand still: stop other programs that move it")]
    Restless,
    /// The pose is outside the configured limits.
    #[error(
        "joint {joint} stands at {q_rad:.4} rad, outside its range: move it back with the vendor's tool"
    )]
    OutsideRange {
        /// Joint, 1-based.
        joint: usize,
        /// Where it stands (rad).
        q_rad: f64,
    },
}

/// A connection for questions. Blocks; not RT-safe.
#[derive(Debug)]
pub struct ArmSession {
    stream: TcpStream,
    reader: FrameReader,
    transaction: u16,
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
            stream: open().map_err(|reason| SessionError::Connect { address, reason })?,
            reader: FrameReader::new(),
            transaction: 0,
            timeout,
        })
    }

    /// Sends a request and waits for its answer; others are skipped.
    ///
    /// # Errors
    /// [`SessionError`]; after one, open a new session.
    pub fn ask(&mut self, command: &Command) -> Result<ReplyData, SessionError> {
        let fail = |reason| SessionError::Transfer {
            command: Box::new(*command),
            reason,
        };
        self.transaction = next_transaction(self.transaction);
        let mut frame = [0; MAX_FRAME_LEN];
        let len = emit_command(&mut frame, self.transaction, Protocol::Private, command)
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

    /// Error code of the arm.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn error_code(&mut self) -> Result<ErrorCode, SessionError> {
        match self.ask(&Command::GetFault)? {
            ReplyData::Fault { error, .. } => Ok(ErrorCode(error)),
            _ => Ok(ErrorCode::NONE),
        }
    }

    /// Enables the arm in servo mode, from whatever state it is in, and
    /// returns the pose in which it stands (rad). Order as in the vendor's
    /// manual: clear, enable, mode, state.
    ///
    /// # Errors
    /// [`SessionError`], each with what to do.
    pub fn bring_up(&mut self, limits: &Limits) -> Result<JointVector, SessionError> {
        if let ReplyData::Text(text) = self.ask(&Command::Version)? {
            tracing::info!(version = text.as_str(), "connected to the arm");
        }
        let enable = Command::MotionEnable {
            joint: Command::ALL_JOINTS,
            enable: true,
        };
        let factor = limits.tcp_speed_max_m_s / SPEED_AT_FACTOR_ONE_M_S;
        for command in [
            Command::CleanError,
            Command::CleanWarning,
            enable,
            Command::SetSpeedLimitFactor(factor),
            Command::SetMode(Mode::Servo),
            Command::SetState(StateRequest::Ready),
        ] {
            self.ask(&command)?;
        }
        self.wait_ready()?;
        let q = self.wait_still()?;
        match limits.position_violation(&q) {
            Some(j) => Err(SessionError::OutsideRange {
                joint: j.saturating_add(1),
                q_rad: q[j],
            }),
            None => Ok(q),
        }
    }

    fn wait_ready(&mut self) -> Result<(), SessionError> {
        let began = Instant::now();
        loop {
            let error = self.error_code()?;
            let ReplyData::State(state) = self.ask(&Command::GetState)? else {
                continue;
            };
            if error.is_none() && state.can_move() {
                return Ok(());
            }
            if began.elapsed() > READY_TIMEOUT {
                return Err(if error.is_none() {
                    SessionError::NotReady { state }
                } else {
                    SessionError::Error(error)
                });
            }
            std::thread::sleep(STILL_INTERVAL);
        }
    }

    fn wait_still(&mut self) -> Result<JointVector, SessionError> {
        let began = Instant::now();
        let mut before: Option<JointVector> = None;
        while began.elapsed() < READY_TIMEOUT {
            let q = match self.ask(&Command::JointPosition(JointQuery::MEASURED))? {
                ReplyData::JointMotion { position, .. } => position,
                _ => continue,
            };
            if before.is_some_and(|b| (b - q).max_abs() < STILL_RAD) {
                return Ok(q);
            }
            before = Some(q);
            std::thread::sleep(STILL_INTERVAL);
        }
        Err(SessionError::Restless)
    }

    /// Asks the arm to stop by itself.
    ///
    /// # Errors
    /// [`SessionError`].
    pub fn stop_arm(&mut self) -> Result<(), SessionError> {
        self.ask(&Command::SetState(StateRequest::Stop)).map(drop)
    }
}
