//! The control core and the simulated arm together in virtual time.
//!
//! ```text
//! operator, guardian beats, commands --> CycleInput --> ControlState::step
//!                                         ^                  |
//!             report feeds, link replies -+                  v
//!                      ^                                 CycleOutput
//!                      |         Network (delay)             |
//!                      +-------- ArmEndpoint <-- bytes ------+
//! ```
//!
//! The core is the real one, so are the cycle around it, command link, report
//! streams, wire format, arm and fault script; only threads, sockets and sleeping are left out. A throw with
//! faults takes milliseconds, and two runs of the same set-up are equal bit for
//! bit. What the controller thought is in [`RigLog::records`] and
//! [`RigLog::causes`], what the arm really got and did in
//! [`RigLog::arm_events`] and [`RigLog::truth`].

mod environment;
mod feeds;
mod network;

pub use environment::Environment;
pub use network::VirtualStream;

use crate::scenario;
use arm_model::joint::START_POSE;
use arm_model::{JointVector, Limits};
use rt_controller::control::monitor::prediction::MeasuredLags;
use rt_controller::control::{ControlCommand, ControlEvent, ControlSettings, ControlState, Motion};
use rt_controller::driver::{CommandMsg, CycleDriver};
use rt_controller::transport::tcp::{LinkSettings, TcpLink};
use rt_controller::xarm::frame::{MAX_FRAME_LEN, emit_command};
use rt_controller::xarm::{Command, Mode, Protocol};
use shared_types::MonotonicNs;
use shared_types::ipc::{CauseRecord, ControllerMode, CycleRecord, InputRecord, RunCounts};
use std::collections::VecDeque;
use xarm_sim::{
    ArmConfig, ArmEndpoint, ArmEvent, ConnectRefused, Fault, FaultScript, JointSample, Service,
    TimedEvent,
};

/// When a virtual rig is switched on.
const START: MonotonicNs = MonotonicNs(1_000_000_000_000);
/// Time the arm is given to come to rest and into its mode (s).
const BRING_UP_S: f64 = 0.3;

/// Set-up of a virtual rig.
#[derive(Debug, Clone)]
pub struct VirtualRigConfig {
    /// Limits of the controller; the arm has its own.
    pub limits: Limits,
    /// What the control core is configured to do.
    pub settings: ControlSettings,
    /// The arm, with its fault script.
    pub arm: ArmConfig,
    /// What was measured of the arm's joints.
    pub lags: MeasuredLags,
    /// Time a byte takes between the two, each way (s).
    pub delay_s: f64,
}

impl VirtualRigConfig {
    fn control(&self) -> ControlState {
        ControlState::new(self.limits.clone(), self.settings).measured(&self.lags)
    }

    /// The arm in its start pose on a good cable, with faults to come.
    #[must_use]
    pub fn new(settings: ControlSettings, faults: FaultScript) -> Self {
        Self {
            limits: Limits::default(),
            settings,
            arm: ArmConfig {
                initial_q: START_POSE,
                faults,
                ..ArmConfig::default()
            },
            lags: MeasuredLags::default(),
            delay_s: 0.0002,
        }
    }
}

/// Everything that happened.
#[derive(Debug, Default)]
pub struct RigLog {
    /// What each cycle was told.
    pub inputs: Vec<InputRecord>,
    /// What each cycle did.
    pub records: Vec<CycleRecord>,
    /// Why it stopped: one record per stop.
    pub causes: Vec<CauseRecord>,
    /// All events of the control core, with the cycle they belong to.
    pub events: Vec<(u64, ControlEvent)>,
    /// What the arm got, from whom, and what happened to it.
    ///
    /// The controller's commands are events of a client; see
    /// [`arrivals`](Self::arrivals).
    pub arm_events: Vec<TimedEvent>,
    /// True joint motion, 1 kHz.
    pub truth: Vec<JointSample>,
}

impl RigLog {
    /// When the controller's commands reached the arm, and what they said: setpoints (rad)
    /// or velocities (rad/s).
    pub fn arrivals(&self) -> impl Iterator<Item = (MonotonicNs, JointVector)> {
        let own = self
            .arm_events
            .iter()
            .filter(|e| e.client != Some(u32::MAX));
        own.filter_map(|e| match e.event {
            ArmEvent::Setpoint(q) => Some((e.at, q)),
            ArmEvent::Velocity { qd, .. } => Some((e.at, qd)),
            _ => None,
        })
    }
}

/// Controller and arm in virtual time. What surrounds the controller, and what
/// has happened so far, is [`Environment`].
#[derive(Debug)]
pub struct VirtualRig {
    config: VirtualRigConfig,
    driver: CycleDriver<TcpLink<VirtualStream>>,
    around: Environment,
    /// By how much the next wake-ups come late (ns).
    late_ns: VecDeque<u64>,
    motions: u64,
}

impl core::ops::Deref for VirtualRig {
    type Target = Environment;

    fn deref(&self) -> &Environment {
        &self.around
    }
}

impl core::ops::DerefMut for VirtualRig {
    fn deref_mut(&mut self) -> &mut Environment {
        &mut self.around
    }
}

impl VirtualRig {
    /// A rig just switched on; the controller is not connected yet.
    #[must_use]
    pub fn new(config: VirtualRigConfig) -> Self {
        let arm = ArmEndpoint::new(config.arm.clone(), START);
        Self {
            driver: CycleDriver::new(config.control(), START.0),
            around: Environment::new(arm, START, config.delay_s),
            late_ns: VecDeque::new(),
            motions: 0,
            config,
        }
    }

    /// Mode of the controller.
    #[must_use]
    pub fn mode(&self) -> ControllerMode {
        self.driver.control().mode()
    }

    /// Pose that the controller commands (rad); a motion begins there.
    #[must_use]
    pub fn commanded(&self) -> JointVector {
        self.driver.control().summary().q_c
    }

    /// What marked the run since the controller took the arm over.
    #[must_use]
    pub fn counts(&self) -> RunCounts {
        self.driver.control().counts()
    }

    /// Whether the controller is connected to the arm.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.driver.is_connected()
    }

    /// Looks at the arm.
    pub fn with_arm<R>(&self, look: impl FnOnce(&mut ArmEndpoint) -> R) -> R {
        look(&mut self.around.network.borrow_mut().arm)
    }

    /// Adds a fault to the arm's script.
    pub fn inject(&mut self, fault: Fault) {
        self.with_arm(|arm| arm.inject(fault));
    }

    /// Brings the arm up in the mode of the command interface and hands the controller a
    /// fresh link: what an operator's acknowledgement does after a stop. The
    /// arm may refuse; the controller then finds out by itself.
    ///
    /// # Errors
    /// [`ConnectRefused`] when the arm cannot be reached.
    pub fn bring_up(&mut self) -> Result<(), ConnectRefused> {
        let mode = Mode::from_code(self.config.settings.interface.arm_mode());
        let mut session = VirtualStream::connect(&self.around.network, Service::Commands)?;
        for (id, command) in scenario::bring_up(mode).iter().enumerate() {
            ask(&mut session, id, command);
        }
        self.run_for(BRING_UP_S);
        drop(session);
        let stream = VirtualStream::connect(&self.around.network, Service::Commands)?;
        let period_ns = MonotonicNs(0).plus_s(self.config.limits.period_s()).0;
        let unanswered_max = self.config.settings.thresholds.unanswered_max;
        let fresh = TcpLink::over(stream, LinkSettings::new(unanswered_max, period_ns));
        let hold = self.with_arm(|arm| arm.model().measured_motion().q);
        self.around.commands.push_back(CommandMsg {
            command: ControlCommand::Engage { hold },
            link: Some(Box::new(fresh)),
        });
        self.run_cycles(2);
        Ok(())
    }

    /// The controller's process dies, its connections with it; the arm is alone
    /// for `span_s`. Then a new process begins its cycles, knowing nothing.
    pub fn kill_controller(&mut self, span_s: f64) {
        let until = self.now().plus_s(span_s);
        self.driver = CycleDriver::new(self.config.control(), until.0);
        self.around.forget();
        self.around.advance_to(until);
    }

    /// Somebody with a connection of his own, as the guardian has, sends the arm
    /// a command.
    ///
    /// # Errors
    /// [`ConnectRefused`] when the arm cannot be reached.
    pub fn command_from_elsewhere(&mut self, command: &Command) -> Result<(), ConnectRefused> {
        let mut session = VirtualStream::connect(&self.around.network, Service::Commands)?;
        ask(&mut session, 0, command);
        // It is gone only once the command has got there.
        self.around
            .advance_to(self.now().plus_s(self.config.delay_s));
        Ok(())
    }

    /// Gives the controller a command with its next cycle.
    pub fn command(&mut self, command: ControlCommand) {
        self.around.commands.push_back(CommandMsg {
            command,
            link: None,
        });
    }

    /// Orders a motion; its number.
    pub fn start(&mut self, motion: Motion) -> u64 {
        self.motions += 1;
        let (id, motion) = (self.motions, Box::new(motion));
        self.command(ControlCommand::Run { id, motion });
        id
    }

    /// The next wake-ups come late by these times (ns).
    pub fn oversleep(&mut self, late_ns: impl IntoIterator<Item = u64>) {
        self.late_ns.extend(late_ns);
    }

    /// The next cycles are held up for these times between wake-up and send (ns).
    pub fn hold_up(&mut self, held_up_ns: impl IntoIterator<Item = u64>) {
        self.around.held_up_ns.extend(held_up_ns);
    }

    /// Runs `count` cycles.
    pub fn run_cycles(&mut self, count: usize) {
        for _ in 0..count {
            self.run_cycle();
        }
    }

    /// Runs for `span_s`.
    pub fn run_for(&mut self, span_s: f64) {
        let until = self.now().plus_s(span_s);
        while MonotonicNs(self.driver.deadline_ns()) <= until {
            self.run_cycle();
        }
    }

    /// Runs until `done`, for `span_s` at most; whether it was.
    pub fn run_until(&mut self, span_s: f64, mut done: impl FnMut(&Self) -> bool) -> bool {
        let until = self.now().plus_s(span_s);
        while self.now() < until {
            if done(self) {
                return true;
            }
            self.run_cycle();
        }
        done(self)
    }

    /// One turn of the loop, paced as the real one.
    fn run_cycle(&mut self) {
        let late_ns = self.late_ns.pop_front().unwrap_or(0);
        let due_ns = self.driver.deadline_ns().saturating_add(late_ns);
        let woke_ns = due_ns.max(self.now().0);
        self.around.advance_to(MonotonicNs(woke_ns));
        self.driver.run_due(woke_ns, &mut self.around);
    }
}

/// Sends a request of the set-up; its reply is not waited for.
fn ask(session: &mut VirtualStream, id: usize, command: &Command) {
    use rt_controller::transport::ByteStream;
    let mut frame = [0; MAX_FRAME_LEN];
    let transaction = u16::try_from(id + 1).unwrap_or(u16::MAX);
    if let Ok(len) = emit_command(&mut frame, transaction, Protocol::Private, command) {
        // A lost connection shows when the controller takes the arm over.
        let _ = session.send(&frame[..len]);
    }
}
