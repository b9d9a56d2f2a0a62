//! The real loop body over a real socket, driven through every mode and every
//! fault it can meet, in virtual time. Whoever runs it looks at each cycle
//! through a [`Watch`].

pub(crate) mod arm;
pub(crate) mod scenarios;

use arm::{EchoArm, Replies};
use arm_model::joint::START_POSE;
use arm_model::{JointVector, Limits, LimitsSpec};
use rt_controller::control::{
    ControlCommand, ControlEvent, ControlSettings, ControlState, Motion, Thresholds,
};
use rt_controller::driver::CommandMsg;
use rt_controller::os::Clock;
use rt_controller::ports::{BridgePorts, Rings, rings};
use rt_controller::rt_loop::RtLoop;
use rt_controller::transport::tcp::{LinkSettings, TcpLink};
use rt_controller::warm_up::report;
use rtrb::Producer;
use shared_types::ipc::{
    Bus, ControllerBoards, ControllerMode, CycleRecord, GuardianBeat, GuardianEnd, JointReport,
    OperatorEnd,
};
use shared_types::{Arming, CommandInterface, FaultCode, OperatingMode};
use std::cell::Cell;
use std::collections::BTreeSet;
use std::rc::Rc;
use std::time::Duration;

/// Sees every cycle.
pub(crate) trait Watch {
    /// Calls `body`, one turn of the loop, once.
    fn around(&mut self, body: &mut dyn FnMut());
}

/// Time that moves by hand.
struct Hand(Rc<Cell<u64>>);

impl Clock for Hand {
    fn now_ns(&self) -> u64 {
        self.0.get()
    }
    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.set(deadline_ns);
    }
}

/// Changes a report that would have been right: what the arm said when this
/// began, and how many cycles ago.
pub(crate) type Spoil = fn(&mut JointReport, &JointReport, u32);

/// What goes wrong from now on.
#[derive(Debug, Default)]
pub(crate) struct Disturbance {
    pub(crate) operator_silent: bool,
    pub(crate) guardian_silent: bool,
    pub(crate) reports_stop: bool,
    /// Cycles that the next one misses.
    pub(crate) missed: u32,
    pub(crate) reports: Option<Spoil>,
}

/// The loop with all that is around it.
pub(crate) struct Bench<'w> {
    rt: RtLoop<TcpLink, Hand>,
    clock: Rc<Cell<u64>>,
    bridge: BridgePorts<TcpLink>,
    reports: Producer<JointReport>,
    pub(crate) arm: EchoArm,
    pub(crate) operator: OperatorEnd,
    guardian: GuardianEnd,
    watch: &'w mut dyn Watch,
    pub(crate) limits: Limits,
    interface: CommandInterface,
    period_ns: u64,
    pub(crate) now_ns: u64,
    pub(crate) newest: CycleRecord,
    said: JointReport,
    pub(crate) disturbance: Disturbance,
    disturbed_cycles: u32,
    pub(crate) cycles: u64,
    pub(crate) seen: [u64; 6],
    /// Causes of stops and refusals so far.
    pub(crate) met: BTreeSet<u16>,
    pub(crate) last_cause: FaultCode,
}

fn settings(interface: CommandInterface) -> ControlSettings {
    ControlSettings {
        interface,
        arming_required: true,
        guardian_required: true,
        ..ControlSettings::from(Thresholds {
            late_cycles_max: 2,
            ..Thresholds::relaxed()
        })
    }
}

impl<'w> Bench<'w> {
    pub(crate) fn new(interface: CommandInterface, rate_hz: f64, watch: &'w mut dyn Watch) -> Self {
        let name = format!(
            "test_gauntlet_{}_{}_{rate_hz}",
            std::process::id(),
            interface as u8
        );
        let bus = Bus::join(&name).unwrap();
        let boards = ControllerBoards::create(&bus).unwrap();
        let limits = Limits::try_from(LimitsSpec {
            rate_hz,
            ..Limits::default().into()
        })
        .unwrap();
        let Rings {
            rt: ports,
            bridge,
            reports: [reports, _],
            ..
        } = rings();
        let now_ns = 1_000_000_000_000;
        let clock = Rc::new(Cell::new(now_ns));
        let control = ControlState::new(limits.clone(), settings(interface));
        Self {
            rt: RtLoop::new(control, Hand(Rc::clone(&clock)), boards, ports),
            clock,
            bridge,
            reports,
            arm: EchoArm::start(),
            operator: OperatorEnd::take(&bus).unwrap(),
            guardian: GuardianEnd::take(&bus).unwrap(),
            watch,
            period_ns: (1e9 * limits.period_s()).round() as u64,
            limits,
            interface,
            now_ns,
            newest: CycleRecord::default(),
            said: JointReport::default(),
            disturbance: Disturbance::default(),
            disturbed_cycles: 0,
            cycles: 0,
            seen: [0; 6],
            met: BTreeSet::new(),
            last_cause: FaultCode::None,
        }
    }

    /// One turn of the loop, and everything that others do meanwhile.
    pub(crate) fn cycle(&mut self) {
        let missed = std::mem::take(&mut self.disturbance.missed);
        self.now_ns += self.period_ns * u64::from(missed + 1);
        self.clock.set(self.now_ns);
        if !self.disturbance.operator_silent {
            self.operator.beat();
        }
        if !self.disturbance.guardian_silent {
            self.guardian.beat(GuardianBeat {
                phase: 1,
                connected: 1,
                ..GuardianBeat::default()
            });
        }
        if !self.disturbance.reports_stop {
            let report = self.report();
            self.reports.push(report).unwrap();
        }
        let (rt, now_ns) = (&mut self.rt, self.now_ns);
        self.watch.around(&mut || {
            rt.cycle(now_ns, missed, now_ns);
        });
        self.cycles += 1;
        self.newest = self.bridge.records.pop().unwrap();
        self.seen[usize::from(self.newest.mode)] += 1;
        while self.bridge.retired.pop().is_ok() {}
        let mut requested = u64::from(self.newest.sent);
        while let Ok(event) = self.bridge.events.pop() {
            let code = match event {
                ControlEvent::Latched(cause) => {
                    self.last_cause = cause.fault();
                    requested += u64::from(cause.stop_arm);
                    cause.fault()
                }
                ControlEvent::Refused { fault, .. } | ControlEvent::Disarmed { fault } => fault,
                _ => continue,
            };
            self.met.insert(code as u16);
        }
        self.arm.meet(requested);
    }

    fn report(&mut self) -> JointReport {
        let mut report = report(self.newest.q_c, self.interface, self.now_ns, self.now_ns);
        match self.disturbance.reports {
            Some(spoil) => {
                self.disturbed_cycles += 1;
                spoil(&mut report, &self.said, self.disturbed_cycles);
            }
            None => {
                self.said = report;
                self.disturbed_cycles = 0;
            }
        }
        report
    }

    pub(crate) fn command(&mut self, command: ControlCommand) {
        self.send(command, None);
    }

    fn send(&mut self, command: ControlCommand, link: Option<Box<TcpLink>>) {
        let message = CommandMsg { command, link };
        self.bridge.commands.push(message).unwrap();
        self.cycle();
    }

    pub(crate) fn mode(&self) -> ControllerMode {
        ControllerMode::from_raw(self.newest.mode)
    }

    /// Everything is well again and the arm is held, over a fresh connection.
    pub(crate) fn recover(&mut self) {
        self.disturbance = Disturbance::default();
        self.operator.hold();
        self.operator.release_stop();
        self.arm.replies = Replies::Good;
        // Reports that are well again come before anybody engages the arm: a spoilt
        // one followed by a true one is a jump.
        for _ in 0..3 {
            self.cycle();
        }
        let most = Thresholds::relaxed().unanswered_max;
        let settings = LinkSettings::new(most, self.period_ns);
        let timeout = Duration::from_secs(5);
        let link = TcpLink::connect(self.arm.address(), timeout, settings).unwrap();
        self.arm.accept();
        self.newest.q_c = START_POSE;
        let hold = ControlCommand::Engage { hold: START_POSE };
        self.send(hold, Some(Box::new(link)));
        assert_eq!(self.mode(), ControllerMode::Idle);
    }

    /// Arms, begins `motion` and follows it for `cycles` at most.
    pub(crate) fn begin(&mut self, motion: Motion, operating_mode: OperatingMode, cycles: usize) {
        self.command(ControlCommand::Arm(Arming {
            operating_mode,
            expires_ns: self.now_ns + 1_000_000_000,
            area_clear: true,
        }));
        let motion = Box::new(motion);
        self.command(ControlCommand::Run { id: 1, motion });
        for _ in 0..cycles {
            self.cycle();
        }
    }

    /// Turns until the arm rests.
    pub(crate) fn until_still(&mut self) {
        for _ in 0..3000 {
            if !self.mode().is_moving() {
                return;
            }
            self.cycle();
        }
        panic!("it moves and moves: {:?}", self.newest);
    }

    /// Holds a while, longer than the reports of a fresh arm are mistrusted.
    pub(crate) fn hold(&mut self) {
        for _ in 0..90 {
            self.cycle();
        }
    }

    pub(crate) fn pose(joint: usize, by_rad: f64) -> JointVector {
        let mut q = START_POSE;
        q[joint - 1] += by_rad;
        q
    }
}
