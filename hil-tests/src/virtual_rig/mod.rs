//! The control core and the simulated arm together in virtual time.
//!
//! ```text
//! operator, guardian beats, orders --> CycleInput --> ControlState::step
//!                                         ^                  |
//!             report feeds, link replies -+                  v
//!                      ^                                 CycleOutput
//!                      |         Network (delay)             |
//!                      +-------- ArmEndpoint <-- bytes ------+
//! ```
//!
//! The core is the real one, so are pacing, command link, wire format, arm and
//! fault script; only threads, sockets and sleeping are left out. A throw with
//! faults takes milliseconds, and two runs of the same set-up are equal bit for
//! bit. What the controller thought is in [`RigLog::records`] and
//! [`RigLog::causes`], what the arm really got and did in
//! [`RigLog::arm_events`] and [`RigLog::truth`].

mod feeds;
mod network;

pub use network::VirtualStream;

use arm_model::{JointVector, Limits};
use feeds::Feed;
use network::Network;
use rt_controller::control::record::record_input;
use rt_controller::control::{
    ControlEvent, ControlSettings, ControlState, CycleInput, Motion, Order,
};
use rt_controller::overrun::{HoldBack, Wake, after_wake, next_wake, setpoint_late_ns};
use rt_controller::transport::slot::LinkSlot;
use rt_controller::transport::tcp::{LinkSettings, TcpLink};
use rt_controller::xarm::frame::{MAX_FRAME_LEN, emit_command};
use rt_controller::xarm::{Command, Mode, Protocol, StateRequest};
use shared_types::ipc::{
    CauseRecord, ControllerMode, CycleRecord, GuardianBeat, InputRecord, OperatorBeat,
    PAYLOAD_VERSION, Reports, RunCounts,
};
use shared_types::{MonotonicNs, WireMode};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use xarm_sim::{
    ArmConfig, ArmEndpoint, ArmEvent, ConnectRefused, Fault, JointSample, ReportKind, Service,
    TimedEvent,
};

/// When a virtual rig is switched on.
const START: MonotonicNs = MonotonicNs(1_000_000_000_000);
/// Time the control core takes for a cycle (s).
const COMPUTE_S: f64 = 20e-6;
/// Time the arm is given to come to rest and into its mode (s).
const BRING_UP_S: f64 = 0.3;

/// Phase of a guardian that watches.
const GUARDIAN_WATCHING: u8 = 1;

/// Set-up of a virtual rig.
#[derive(Debug, Clone)]
pub struct VirtualRigConfig {
    /// Limits of the controller; the arm has its own.
    pub limits: Limits,
    /// What the control core is configured to do.
    pub settings: ControlSettings,
    /// The arm, with its fault script.
    pub arm: ArmConfig,
    /// Time a byte takes between the two, each way (s).
    pub delay_s: f64,
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
    /// The controller's setpoints are events of a client; see
    /// [`setpoints`](Self::setpoints).
    pub arm_events: Vec<TimedEvent>,
    /// True joint motion, 1 kHz.
    pub truth: Vec<JointSample>,
}

impl RigLog {
    /// Setpoints that the arm got from the controller (rad).
    pub fn setpoints(&self) -> impl Iterator<Item = (MonotonicNs, JointVector)> {
        self.arm_events.iter().filter_map(|e| match e.event {
            ArmEvent::Setpoint(q) if e.client != Some(u32::MAX) => Some((e.at, q)),
            _ => None,
        })
    }
}

/// Controller and arm in virtual time.
#[derive(Debug)]
pub struct VirtualRig {
    config: VirtualRigConfig,
    network: Rc<RefCell<Network>>,
    control: ControlState,
    link: LinkSlot<TcpLink<VirtualStream>>,
    joints: Feed,
    codes: Feed,
    next: Wake,
    orders: VecDeque<Order>,
    /// By how much the next wake-ups come late (ns).
    late_ns: VecDeque<u64>,
    /// For how long the next cycles are held up before they send (ns).
    held_up_ns: VecDeque<u64>,
    held: HoldBack,
    motions: u64,
    operator_beat: OperatorBeat,
    guardian_beat: GuardianBeat,
    /// The operator's program lives and beats.
    pub operator_alive: bool,
    /// The operator asks for a stop.
    pub operator_stop: bool,
    /// The operator has let go of the dead-man switch.
    pub dead_man_released: bool,
    /// The guardian lives and beats.
    pub guardian_alive: bool,
    /// What has happened so far.
    pub log: RigLog,
}

impl VirtualRig {
    /// A rig just switched on; the controller is not connected yet.
    #[must_use]
    pub fn new(config: VirtualRigConfig) -> Self {
        let arm = ArmEndpoint::new(config.arm.clone(), START);
        let network = Network::new(arm, START, config.delay_s);
        Self {
            network: Rc::new(RefCell::new(network)),
            control: ControlState::new(config.limits.clone(), config.settings),
            link: LinkSlot::new(config.settings.wire),
            joints: Feed::new(ReportKind::Realtime),
            codes: Feed::new(ReportKind::Rich),
            next: Wake {
                deadline_ns: START.plus_s(config.limits.period_s()).0,
                missed: 0,
            },
            orders: VecDeque::new(),
            late_ns: VecDeque::new(),
            held_up_ns: VecDeque::new(),
            held: HoldBack::default(),
            motions: 0,
            operator_beat: OperatorBeat {
                version: PAYLOAD_VERSION,
                ..OperatorBeat::default()
            },
            guardian_beat: GuardianBeat {
                version: PAYLOAD_VERSION,
                phase: GUARDIAN_WATCHING,
                connected: 1,
                ..GuardianBeat::default()
            },
            operator_alive: true,
            operator_stop: false,
            dead_man_released: false,
            guardian_alive: true,
            log: RigLog::default(),
            config,
        }
    }

    /// The present.
    #[must_use]
    pub fn now(&self) -> MonotonicNs {
        self.network.borrow().now
    }

    /// Mode of the controller.
    #[must_use]
    pub fn mode(&self) -> ControllerMode {
        self.control.mode()
    }

    /// Pose that the controller commands (rad); a motion begins there.
    #[must_use]
    pub fn commanded(&self) -> JointVector {
        self.control.summary().q_c
    }

    /// What marked the run since the controller took the arm over.
    #[must_use]
    pub fn counts(&self) -> RunCounts {
        self.control.counts()
    }

    /// Whether the controller is connected to the arm.
    #[must_use]
    pub fn is_connected(&self) -> bool {
        self.link.is_connected()
    }

    /// Looks at the arm.
    pub fn with_arm<R>(&self, look: impl FnOnce(&mut ArmEndpoint) -> R) -> R {
        look(&mut self.network.borrow_mut().arm)
    }

    /// Adds a fault to the arm's script.
    pub fn inject(&mut self, fault: Fault) {
        self.with_arm(|arm| arm.inject(fault));
    }

    /// Brings the arm up in the mode of the wire and hands the controller a
    /// fresh link: what an operator's acknowledgement does after a stop. The
    /// arm may refuse; the controller then finds out by itself.
    ///
    /// # Errors
    /// [`ConnectRefused`] when the arm cannot be reached.
    pub fn bring_up(&mut self) -> Result<(), ConnectRefused> {
        let mode = match self.config.settings.wire {
            WireMode::ServoPosition => Mode::Servo,
            WireMode::JointVelocity => Mode::JointVelocity,
        };
        let mut session = VirtualStream::connect(&self.network, Service::Commands)?;
        for (id, command) in [
            Command::CleanError,
            Command::CleanWarning,
            Command::MotionEnable {
                joint: Command::ALL_JOINTS,
                enable: true,
            },
            Command::SetMode(mode),
            Command::SetState(StateRequest::Ready),
        ]
        .iter()
        .enumerate()
        {
            ask(&mut session, id, command);
        }
        self.run_for(BRING_UP_S);
        drop(session);
        let stream = VirtualStream::connect(&self.network, Service::Commands)?;
        let period_ns = MonotonicNs(0).plus_s(self.config.limits.period_s()).0;
        let unanswered_max = self.config.settings.thresholds.unanswered_max;
        let fresh = TcpLink::over(stream, LinkSettings::new(unanswered_max, period_ns));
        drop(self.link.replace(Some(Box::new(fresh))));
        let hold = self.with_arm(|arm| arm.model().measured_motion().q);
        self.orders.push_back(Order::Adopt { hold });
        self.run_cycles(2);
        Ok(())
    }

    /// The controller's process dies, its connections with it; the arm is alone
    /// for `span_s`. Then a new process begins its cycles, knowing nothing.
    pub fn kill_controller(&mut self, span_s: f64) {
        drop(self.link.replace(None));
        self.joints = Feed::new(ReportKind::Realtime);
        self.codes = Feed::new(ReportKind::Rich);
        self.orders.clear();
        self.control = ControlState::new(self.config.limits.clone(), self.config.settings);
        let until = self.now().plus_s(span_s);
        self.advance_to(until);
        self.next = Wake {
            deadline_ns: until.plus_s(self.config.limits.period_s()).0,
            missed: 0,
        };
    }

    /// Somebody with a connection of his own, as the guardian has, sends the arm
    /// a command.
    ///
    /// # Errors
    /// [`ConnectRefused`] when the arm cannot be reached.
    pub fn command_from_elsewhere(&mut self, command: &Command) -> Result<(), ConnectRefused> {
        let mut session = VirtualStream::connect(&self.network, Service::Commands)?;
        ask(&mut session, 0, command);
        // It is gone only once the command has got there.
        self.advance_to(self.now().plus_s(self.config.delay_s));
        Ok(())
    }

    /// Gives the controller an order with its next cycle.
    pub fn order(&mut self, order: Order) {
        self.orders.push_back(order);
    }

    /// Orders a motion; its number.
    pub fn start(&mut self, motion: Motion) -> u64 {
        self.motions += 1;
        let (id, motion) = (self.motions, Box::new(motion));
        self.orders.push_back(Order::Run { id, motion });
        id
    }

    /// The next wake-ups come late by these times (ns).
    pub fn oversleep(&mut self, late_ns: impl IntoIterator<Item = u64>) {
        self.late_ns.extend(late_ns);
    }

    /// The next cycles are held up for these times between wake-up and send (ns).
    pub fn hold_up(&mut self, held_up_ns: impl IntoIterator<Item = u64>) {
        self.held_up_ns.extend(held_up_ns);
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
        while MonotonicNs(self.next.deadline_ns) <= until {
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
        let period_ns = MonotonicNs(0).plus_s(self.config.limits.period_s()).0;
        let late_ns = self.late_ns.pop_front().unwrap_or(0);
        let woke_ns = self
            .next
            .deadline_ns
            .saturating_add(late_ns)
            .max(self.now().0);
        self.advance_to(MonotonicNs(woke_ns));
        let due = after_wake(self.next.deadline_ns, woke_ns, period_ns);
        let missed = due.missed.saturating_add(self.next.missed);
        let sent_ns = self.cycle(due.deadline_ns, missed, woke_ns);
        self.next = next_wake(due.deadline_ns, sent_ns, self.now().0, period_ns);
    }

    fn advance_to(&mut self, now: MonotonicNs) {
        let mut net = self.network.borrow_mut();
        net.advance_to(now, |sample| self.log.truth.push(sample));
        self.log.arm_events.extend(net.arm.take_events());
    }

    /// One cycle, as the real loop's; returns when it sent.
    fn cycle(&mut self, deadline_ns: u64, missed: u32, woke_ns: u64) -> u64 {
        let missed = missed.saturating_add(self.held.missed());
        let mut input = self.take_in(deadline_ns, missed);
        let period_ns = MonotonicNs(0).plus_s(self.config.limits.period_s()).0;
        input.late_ns = setpoint_late_ns(deadline_ns, woke_ns, missed, period_ns);
        self.log
            .inputs
            .push(record_input(&input, self.control.cycle() + 1));
        let mut out = self.control.step(input);
        let held_up_ns = self.held_up_ns.pop_front().unwrap_or(0);
        let computed_ns = MonotonicNs(woke_ns).plus_s(COMPUTE_S).0;
        self.advance_to(MonotonicNs(computed_ns.saturating_add(held_up_ns)));
        let now_ns = self.now().0;
        let held = out.command.is_some() && self.held.holds(woke_ns, now_ns, period_ns);
        let command = out.command.filter(|_| !held);
        self.link.send(command, out.request, now_ns);
        let span_ns = |from_ns: u64, to_ns: u64| {
            u32::try_from(to_ns.saturating_sub(from_ns)).unwrap_or(u32::MAX)
        };
        out.record.wake_late_ns = span_ns(deadline_ns, woke_ns);
        out.record.compute_ns = span_ns(woke_ns, now_ns);
        out.record.send_ns = command.map_or(0, |_| span_ns(woke_ns, now_ns));
        self.log.records.push(out.record);
        for event in &out.events {
            if let ControlEvent::Latched(cause) = event {
                self.log.causes.push(*cause);
            }
            self.log.events.push((self.control.cycle(), *event));
        }
        if held { deadline_ns } else { now_ns }
    }

    fn take_in(&mut self, deadline_ns: u64, missed: u32) -> CycleInput {
        self.beat();
        let link = self.link.poll(self.now().0);
        if link.lost {
            drop(self.link.replace(None));
        }
        let mut reports = Reports::default();
        for report in self.joints.joints(&self.network) {
            reports.push(report);
        }
        CycleInput {
            deadline_ns,
            missed,
            late_ns: 0,
            order: self.orders.pop_front(),
            operator: self.operator_beat,
            guardian: self.guardian_beat,
            link,
            codes: self.codes.codes(&self.network),
            reports,
            broken_reports: self.joints.take_broken(),
        }
    }

    /// The living beat; what is dead leaves its last beat standing.
    fn beat(&mut self) {
        if self.operator_alive {
            let beat = &mut self.operator_beat;
            beat.count += 1;
            beat.stop = u32::from(self.operator_stop);
            beat.released = u32::from(self.dead_man_released);
        }
        if self.guardian_alive {
            self.guardian_beat.count += 1;
            self.guardian_beat.stamp_ns = self.network.borrow().now.0;
        }
    }
}

/// Sends a request of the set-up; its reply is not waited for.
fn ask(session: &mut VirtualStream, id: usize, command: &Command) {
    use rt_controller::transport::ByteWire;
    let mut frame = [0; MAX_FRAME_LEN];
    let transaction = u16::try_from(id + 1).unwrap_or(u16::MAX);
    if let Ok(len) = emit_command(&mut frame, transaction, Protocol::Private, command) {
        // A lost connection shows when the controller takes the arm over.
        let _ = session.send(&frame[..len]);
    }
}
