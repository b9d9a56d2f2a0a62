//! What surrounds the control cycle in virtual time: the arm behind its cable, the
//! heartbeats, the commands, the clock, and the log of what happened.

use super::RigLog;
use super::feeds::Feed;
use super::network::{Network, VirtualStream};
use rt_controller::control::{ArmCodes, ControlEvent, ControlState, CycleOutput};
use rt_controller::driver::{CommandMsg, CycleIo};
use rt_controller::report_feed::{JointDecoder, arm_codes};
use rt_controller::transport::tcp::TcpLink;
use shared_types::MonotonicNs;
use shared_types::ipc::{
    ControllerState, GuardianBeat, InputRecord, OperatorBeat, PAYLOAD_VERSION, Reports,
};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use xarm_sim::{ArmEndpoint, ReportKind};

/// Time the control core takes for a cycle (s).
const COMPUTE_S: f64 = 20e-6;

type Link = TcpLink<VirtualStream>;

/// Everything that the control cycle hears and tells.
#[derive(Debug)]
pub struct Environment {
    pub(super) network: Rc<RefCell<Network>>,
    joints: Feed,
    decoder: JointDecoder,
    codes: Feed,
    pub(super) commands: VecDeque<CommandMsg<Link>>,
    /// For how long the next cycles are held up before they send (ns).
    pub(super) held_up_ns: VecDeque<u64>,
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

impl Environment {
    pub(super) fn new(arm: ArmEndpoint, start: MonotonicNs, delay_s: f64) -> Self {
        Self {
            network: Rc::new(RefCell::new(Network::new(arm, start, delay_s))),
            joints: Feed::new(ReportKind::Realtime),
            decoder: JointDecoder::default(),
            codes: Feed::new(ReportKind::Rich),
            commands: VecDeque::new(),
            held_up_ns: VecDeque::new(),
            operator_beat: OperatorBeat {
                version: PAYLOAD_VERSION,
                ..OperatorBeat::default()
            },
            guardian_beat: GuardianBeat {
                version: PAYLOAD_VERSION,
                phase: GuardianBeat::WATCHING,
                connected: 1,
                ..GuardianBeat::default()
            },
            operator_alive: true,
            operator_stop: false,
            dead_man_released: false,
            guardian_alive: true,
            log: RigLog::default(),
        }
    }

    /// The present.
    #[must_use]
    pub fn now(&self) -> MonotonicNs {
        self.network.borrow().now
    }

    pub(super) fn advance_to(&mut self, now: MonotonicNs) {
        let mut net = self.network.borrow_mut();
        net.advance_to(now, |sample| self.log.truth.push(sample));
        self.log.arm_events.extend(net.arm.take_events());
    }

    /// The controller's process is gone, its connections and commands with it.
    pub(super) fn forget(&mut self) {
        self.joints = Feed::new(ReportKind::Realtime);
        self.codes = Feed::new(ReportKind::Rich);
        self.commands.clear();
    }
}

/// A living beat goes on with each cycle; what is dead leaves its last standing.
impl CycleIo<Link> for Environment {
    fn now_ns(&self) -> u64 {
        self.now().0
    }

    fn operator(&mut self) -> OperatorBeat {
        if self.operator_alive {
            let beat = &mut self.operator_beat;
            beat.count += 1;
            beat.stop = u32::from(self.operator_stop);
            beat.released = u32::from(self.dead_man_released);
        }
        self.operator_beat
    }

    fn guardian(&mut self) -> GuardianBeat {
        if self.guardian_alive {
            self.guardian_beat.count += 1;
            self.guardian_beat.stamp_ns = self.now().0;
        }
        self.guardian_beat
    }

    fn next_command(&mut self) -> Option<CommandMsg<Link>> {
        self.commands.pop_front()
    }

    fn new_reports(&mut self) -> Reports {
        if self.joints.reopen(&self.network) {
            self.decoder = JointDecoder::default();
        }
        let (now_ns, decoder) = (self.now().0, &mut self.decoder);
        let mut reports = Reports::default();
        self.joints.frames(now_ns, |frame| {
            let decoded = decoder.realtime(frame, now_ns);
            decoded.map(|report| reports.push(report)).is_some()
        });
        reports
    }

    fn new_broken_reports(&mut self) -> u32 {
        self.joints.take_broken() + self.codes.take_broken()
    }

    fn new_codes(&mut self) -> Option<ArmCodes> {
        self.codes.reopen(&self.network);
        let now_ns = self.now().0;
        let mut newest = None;
        self.codes.frames(now_ns, |frame| {
            let decoded = arm_codes(frame, now_ns);
            newest = decoded.or(newest);
            decoded.is_some()
        });
        newest
    }

    /// The core is about to be stepped; the time that takes passes here.
    fn put_input(&mut self, input: InputRecord) {
        self.log.inputs.push(input);
        let held_up_ns = self.held_up_ns.pop_front().unwrap_or(0);
        let computed_ns = self.now().plus_s(COMPUTE_S).0;
        self.advance_to(MonotonicNs(computed_ns.saturating_add(held_up_ns)));
    }

    fn publish(&mut self, _state: ControllerState) {}

    fn put_output(&mut self, out: CycleOutput) {
        for event in out.events {
            if let ControlEvent::Latched(cause) = event {
                self.log.causes.push(cause);
            }
            self.log.events.push((out.record.cycle, event));
        }
        self.log.records.push(out.record);
    }

    fn put_state(&mut self, _control: &ControlState) {}

    fn retire_link(&mut self, _link: Box<Link>) {}
}
