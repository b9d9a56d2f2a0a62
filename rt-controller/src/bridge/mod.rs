//! The bridge: how other processes reach the controller, outside the
//! real-time thread.
//!
//! It publishes what the loop and the report receiver put into their rings,
//! answers [`ControllerRpc`], plans and checks every motion before the loop
//! gets it, and sets the arm up. It may allocate, wait and log; the loop never
//! waits for it.

mod answers;
mod arming;
mod latency;
mod recording;
mod requests;
mod uploads;

use crate::commander::CommanderLock;
use crate::config::ControllerConfig;
use crate::control::{ArmCodes, ControlCommand, ControlEvent, ControlSettings, Motion};
use crate::driver::CommandMsg;
use crate::error::ControllerError;
use crate::os::now_ns;
use crate::ports::BridgePorts;
use crate::recording::ChunkWriter;
use crate::session::{ArmSession, stop_until_confirmed};
use crate::transport::tcp::TcpLink;
use crate::xarm::ErrorCode;
use answers::{ControllerCall, answer, refuse, stopped};
use arm_model::Limits;
pub use latency::Latencies;
use recording::RecordingFeed;
use shared_types::ipc::message::{ControllerEvent, ControllerRpc};
use shared_types::ipc::rpc::RpcServer;
use shared_types::ipc::{
    Bus, ControllerMode, CyclePublisher, CycleRecord, JointPublisher, JointReport,
};
use shared_types::{FaultCode, OperatingMode};
use std::collections::VecDeque;
use std::net::SocketAddr;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use uploads::Uploads;

/// Longest wait for one answer of the arm while it is set up.
const SET_UP_TIMEOUT: Duration = Duration::from_secs(2);
/// The same for a question about an error or a digital input, when callers wait.
const QUESTION_TIMEOUT: Duration = Duration::from_millis(200);
/// Longest wait of a bring-up for the first joint report and for the guardian.
const REPORT_WAIT: Duration = Duration::from_secs(3);

/// A call that is answered later.
struct Open {
    call: ControllerCall,
    awaits: Awaited,
}

/// What answers it.
enum Awaited {
    /// The end of motions in order; the last one is what was asked for.
    Motion {
        id: u64,
        next: VecDeque<Box<Motion>>,
    },
    /// The controller is armed.
    Armed,
    /// The arm is latched, or was not held.
    Stopped,
    /// The loop holds the arm, joint reports come, and a guardian watches.
    Engaged { held: bool, until: Instant },
}

/// The bridge and all it owns. Lives in the thread that opened it.
pub struct Bridge {
    config: ControllerConfig,
    limits: Limits,
    settings: ControlSettings,
    commander: Option<CommanderLock>,
    warnings: Vec<String>,
    /// What the operator should know of the arm, by its newest bring-up.
    arm_warnings: Vec<String>,
    ports: BridgePorts<TcpLink>,
    server: RpcServer<ControllerRpc>,
    cycles: CyclePublisher,
    joints: JointPublisher,
    recording: RecordingFeed,
    latencies: Latencies,
    newest: CycleRecord,
    newest_report: Option<JointReport>,
    /// A guardian watches that could stop the arm.
    guarded: bool,
    /// Error and warning that the arm reported last.
    arm_codes: (ErrorCode, u8),
    arm_error: ErrorCode,
    open: Vec<Open>,
    uploads: Uploads,
    /// For what the arm is armed, or why it is not.
    armed: Result<OperatingMode, FaultCode>,
    /// When the arm last came to rest (CLOCK_MONOTONIC, ns).
    at_rest_ns: u64,
    /// When the area was confirmed clear for what is armed (CLOCK_MONOTONIC, ns).
    confirmed_ns: Option<u64>,
    /// By when what is armed must begin (CLOCK_MONOTONIC, ns).
    begins_by_ns: Option<u64>,
    last_id: u64,
    /// Asks the arm to stop until it says that it has.
    stopping: Option<JoinHandle<()>>,
}

impl core::fmt::Debug for Bridge {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Bridge")
            .field("arm", &self.config.arm)
            .field("open", &self.open.len())
            .finish_non_exhaustive()
    }
}

impl Bridge {
    /// Opens all services of a controller with a checked configuration, the limits and
    /// settings that it names. `warnings` are the real-time properties that could
    /// not be had, in words.
    pub fn open(
        bus: &Bus,
        config: ControllerConfig,
        (limits, settings): (Limits, ControlSettings),
        warnings: Vec<String>,
        ports: BridgePorts<TcpLink>,
    ) -> Result<Self, ControllerError> {
        Ok(Self {
            config,
            limits,
            settings,
            commander: None,
            warnings,
            arm_warnings: Vec::new(),
            ports,
            server: RpcServer::open(bus)?,
            cycles: bus.cycle_publisher()?,
            joints: bus.joint_publisher()?,
            recording: RecordingFeed::open(bus)?,
            latencies: Latencies::new()?,
            newest: CycleRecord::default(),
            newest_report: None,
            guarded: false,
            arm_codes: (ErrorCode::NONE, 0),
            arm_error: ErrorCode::NONE,
            open: Vec::new(),
            uploads: Uploads::default(),
            armed: Err(FaultCode::NotArmed),
            at_rest_ns: 0,
            confirmed_ns: None,
            begins_by_ns: None,
            last_id: 0,
            stopping: None,
        })
    }

    /// Where the arm takes commands.
    fn command_port(&self) -> SocketAddr {
        SocketAddr::new(self.config.arm, self.config.command_port)
    }

    /// Mode of the loop, as of its newest record.
    #[must_use]
    pub fn mode(&self) -> ControllerMode {
        ControllerMode::from_raw(self.newest.mode)
    }

    /// Number of the loop's newest cycle.
    #[must_use]
    pub fn cycle(&self) -> u64 {
        self.newest.cycle
    }

    /// Does all that has come up since the last turn. Call it every few
    /// milliseconds.
    pub fn turn(&mut self) {
        self.publish();
        while self.ports.retired.pop().is_ok() {}
        while let Ok(event) = self.ports.events.pop() {
            self.on_event(event);
        }
        self.settle_engagements();
        self.uploads.settle();
        loop {
            match self.server.receive() {
                Ok(Some(call)) => self.serve(call),
                Ok(None) => break,
                Err(reason) => {
                    tracing::warn!(%reason, "a request was dropped");
                    break;
                }
            }
        }
    }

    /// Hands out what is recorded but not sent yet; the last thing to do.
    pub fn end_recording(&mut self) {
        self.recording.add(ChunkWriter::flush);
    }

    /// Asks the loop to brake and latch.
    pub fn stop(&mut self) {
        let _ = self.command(ControlCommand::Stop, None);
    }

    /// Asks the arm itself to stop until it says that it has, in a thread that
    /// [`confirm_stop`](Self::confirm_stop) waits for. The loop has asked once, if it could.
    pub fn stop_arm(&mut self) {
        if self.stops_arm() {
            return;
        }
        let arm = self.command_port();
        let asked = std::thread::Builder::new().name("stop".to_owned());
        self.stopping = asked.spawn(move || stop_until_confirmed(arm)).ok();
        if self.stopping.is_none() {
            stop_until_confirmed(arm);
        }
    }

    /// Waits until a stop was confirmed or given up: at most 3 s and a time-out.
    pub fn confirm_stop(&mut self) {
        if let Some(stopping) = self.stopping.take() {
            let _ = stopping.join();
        }
    }

    fn publish(&mut self) {
        let mut failed = None;
        while let Ok(record) = self.ports.records.pop() {
            self.latencies.record(&record);
            self.newest = record;
            failed = self.cycles.send_copy(record).err().or(failed);
            if let Some(state) = self.ports.state_before(record.cycle) {
                self.recording.add(|writer| writer.keyframe(&state));
            }
            if let Some(cycle) = self.ports.recorded(record) {
                self.guarded = cycle.input.guardian.guards();
                self.recording.add(|writer| writer.cycle(&cycle));
            }
        }
        while let Ok(report) = self.ports.reports.pop() {
            self.newest_report = Some(report);
            let sent = self.joints.send_copy(report);
            failed = sent.err().or(failed);
        }
        while let Ok(codes) = self.ports.codes.pop() {
            self.on_codes(codes);
        }
        if let Some(reason) = failed {
            tracing::warn!(?reason, "records could not be published");
        }
    }

    /// Says so when the arm's codes change.
    fn on_codes(&mut self, codes: ArmCodes) {
        let (error, warning) = (ErrorCode(codes.error), codes.warning);
        if self.arm_codes != (error, warning) {
            tracing::warn!(%error, warning, "the arm's codes changed");
        }
        self.arm_codes = (error, warning);
    }

    /// Hands a command to the loop.
    fn command(
        &mut self,
        command: ControlCommand,
        link: Option<Box<TcpLink>>,
    ) -> Result<(), FaultCode> {
        self.ports
            .commands
            .push(CommandMsg { command, link })
            .map_err(|_full| FaultCode::WrongMode)
    }

    fn on_event(&mut self, event: ControlEvent) {
        match event {
            ControlEvent::Engaged => {
                self.arm_error = ErrorCode::NONE;
                self.at_rest_ns = now_ns();
                for open in &mut self.open {
                    if let Awaited::Engaged { held, .. } = &mut open.awaits {
                        *held = true;
                    }
                }
            }
            ControlEvent::Started { id, start_ns } => {
                for open in &self.open {
                    if let Awaited::Motion { id: its, next } = &open.awaits
                        && *its == id
                        && next.is_empty()
                    {
                        answer(&open.call, &ControllerEvent::Started { start_ns });
                    }
                }
            }
            ControlEvent::Finished {
                id,
                start_ns,
                end_ns,
            } => {
                self.at_rest_ns = end_ns;
                self.on_finished(id, &ControllerEvent::Finished { start_ns, end_ns });
            }
            ControlEvent::Refused { id, fault } => {
                let refused = |awaits: &Awaited| match (awaits, id) {
                    (Awaited::Motion { id, .. }, Some(refused)) => *id == refused,
                    (Awaited::Armed | Awaited::Engaged { .. }, None) => true,
                    _ => false,
                };
                // The loop has told that the arming ran out, and disarmed, before.
                let expired =
                    fault == FaultCode::NotArmed && self.armed == Err(FaultCode::ArmingExpired);
                let fault = if expired {
                    FaultCode::ArmingExpired
                } else {
                    fault
                };
                for open in self.take(refused) {
                    refuse(&open.call, fault, "");
                }
            }
            ControlEvent::Latched(cause) => {
                self.recording.writer.cause(&cause);
                if cause.stop_arm != 0 {
                    self.stop_arm();
                }
                self.on_latched(cause.fault(), cause.cycle);
            }
            ControlEvent::Armed(arming) => {
                tracing::info!(?arming, "armed");
                self.armed = Ok(arming.operating_mode);
                for open in self.take(|awaits| matches!(awaits, Awaited::Armed)) {
                    answer(&open.call, &ControllerEvent::Done);
                }
            }
            ControlEvent::AtRest => {
                let stopped = |open: &Open| matches!(open.awaits, Awaited::Stopped);
                if let Some(oldest) = self.open.iter().position(stopped) {
                    answer(&self.open.remove(oldest).call, &ControllerEvent::Done);
                }
            }
            ControlEvent::Disarmed { fault } => {
                tracing::info!(?fault, "disarmed");
                let expired = fault == FaultCode::ArmingExpired;
                self.armed = Err(if expired { fault } else { FaultCode::NotArmed });
            }
        }
    }

    /// Takes the open calls that await something of this kind.
    fn take(&mut self, kind: impl Fn(&Awaited) -> bool) -> Vec<Open> {
        let taken = self.open.extract_if(.., |open| kind(&open.awaits));
        taken.collect()
    }

    /// Goes on to the next motion of a call, or answers it.
    fn on_finished(&mut self, finished: u64, event: &ControllerEvent) {
        let its = |a: &Awaited| matches!(a, Awaited::Motion { id, .. } if *id == finished);
        for Open { call, awaits } in self.take(its) {
            let Awaited::Motion { mut next, .. } = awaits else {
                continue;
            };
            match next.pop_front() {
                None => answer(&call, event),
                Some(motion) => self.begin(call, motion, next),
            }
        }
    }

    /// Whether a stop or an engagement is on its way, or the arm still asked to stop.
    fn settles(&self) -> bool {
        let awaited =
            |open: &Open| matches!(open.awaits, Awaited::Stopped | Awaited::Engaged { .. });
        self.stops_arm() || self.open.iter().any(awaited)
    }

    /// Whether the arm is still asked to stop.
    fn stops_arm(&self) -> bool {
        let stopping = self.stopping.as_ref();
        stopping.is_some_and(|thread| !thread.is_finished())
    }

    /// Whether a motion is under way for a caller.
    fn moves(&self) -> bool {
        let motion = |open: &Open| matches!(open.awaits, Awaited::Motion { .. });
        self.open.iter().any(motion)
    }

    fn on_latched(&mut self, fault: FaultCode, cycle: u64) {
        let mut fault = fault;
        self.arm_error = match fault {
            FaultCode::ArmError | FaultCode::ArmModeChanged | FaultCode::ArmNotReady => {
                self.ask_error()
            }
            _ => ErrorCode::NONE,
        };
        if !self.arm_error.is_none() {
            fault = FaultCode::ArmError;
        }
        if fault == FaultCode::OperatorStop && !self.moves() {
            // How every session ends: nothing moved, nothing is wrong.
            tracing::info!(cycle, "commanded to stop at rest");
        } else {
            tracing::warn!(?fault, cycle, arm_error = %self.arm_error, "stopped");
        }
        for Open { call, awaits } in self.open.drain(..) {
            match awaits {
                Awaited::Motion { .. } => answer(&call, &stopped(fault, cycle, self.arm_error)),
                Awaited::Stopped => answer(&call, &ControllerEvent::Done),
                Awaited::Engaged { .. } | Awaited::Armed => refuse(&call, fault, ""),
            }
        }
    }

    fn ask_error(&self) -> ErrorCode {
        ArmSession::connect(self.command_port(), QUESTION_TIMEOUT)
            .and_then(|mut session| session.error_code())
            .unwrap_or(ErrorCode::NONE)
    }

    /// Begins a motion for `call`; `next` follow it.
    fn begin(&mut self, call: ControllerCall, motion: Box<Motion>, next: VecDeque<Box<Motion>>) {
        self.last_id += 1;
        let id = self.last_id;
        self.recording.writer.motion(id, &motion);
        match self.command(ControlCommand::Run { id, motion }, None) {
            Ok(()) => {
                let awaits = Awaited::Motion { id, next };
                self.open.push(Open { call, awaits });
            }
            Err(fault) => refuse(&call, fault, ""),
        }
    }
}
