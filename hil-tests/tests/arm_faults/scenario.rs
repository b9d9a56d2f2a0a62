//! An arm in virtual time and a client of its command port.

use arm_model::JointVector;
use hil_tests::scenario::bring_up;
use rt_controller::xarm::frame::{MAX_FRAME_LEN, emit_command};
use rt_controller::xarm::{Command, ErrorCode, FrameReader, Mode, Protocol, Status};
use shared_types::MonotonicNs;
use xarm_sim::{ArmConfig, ArmEndpoint, ArmEvent, FaultScript, ReportKind, Service, TimedEvent};

pub const START: MonotonicNs = MonotonicNs(7_000_000_000);
pub const CYCLE_S: f64 = 0.004;

/// A reply as it came: time since the start (ms), transaction, register, status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Seen {
    pub ms: u64,
    pub transaction: u16,
    pub register: u8,
    pub status: u8,
}

/// An arm in virtual time with a client of the command port.
pub struct Scenario {
    pub arm: ArmEndpoint,
    pub now: MonotonicNs,
    pub client: u32,
    pub transaction: u16,
    pub replies: Vec<Seen>,
    pub events: Vec<TimedEvent>,
    pub q: JointVector,
}

impl Scenario {
    pub fn new(script: &str) -> Self {
        Self::with(script, ArmConfig::default())
    }

    pub fn with(script: &str, config: ArmConfig) -> Self {
        let q = config.initial_q;
        let config = ArmConfig {
            faults: script.parse::<FaultScript>().unwrap(),
            ..config
        };
        let mut arm = ArmEndpoint::new(config, START);
        let client = arm.connect(Service::Commands, START).unwrap();
        Self {
            arm,
            now: START,
            client,
            transaction: 0,
            replies: Vec::new(),
            events: Vec::new(),
            q,
        }
    }

    /// A client of a report port.
    pub fn reports(&mut self, kind: ReportKind) -> u32 {
        self.arm.connect(Service::Reports(kind), self.now).unwrap()
    }

    pub fn send(&mut self, command: &Command) {
        self.transaction += 1;
        let mut out = [0; MAX_FRAME_LEN];
        let n = emit_command(&mut out, self.transaction, Protocol::Private, command).unwrap();
        self.arm.receive(self.client, self.now, &out[..n]);
        self.take_replies();
    }

    pub fn take_replies(&mut self) {
        while let Some(bytes) = self.arm.take_frame(self.client, self.now) {
            let mut reader = FrameReader::new();
            reader.feed(&bytes);
            let reply = reader.next_frame().unwrap().unwrap().as_reply().unwrap();
            self.replies.push(Seen {
                ms: (self.now.0 - START.0) / 1_000_000,
                transaction: reply.transaction,
                register: reply.register,
                status: reply.status.0,
            });
        }
        self.events.extend(self.arm.take_events());
    }

    /// Millisecond by millisecond.
    pub fn wait(&mut self, span_s: f64) {
        let until = self.now.plus_s(span_s);
        while self.now < until {
            self.now = self.now.plus_s(1e-3).min(until);
            self.arm.advance_to(self.now, |_| ());
            self.take_replies();
        }
    }

    pub fn bring_up(&mut self, mode: Mode) {
        for command in bring_up(mode) {
            self.send(&command);
        }
    }

    /// Streams joint 7 for `span_s`.
    pub fn stream(&mut self, speed_rad_s: f64, span_s: f64) {
        for _ in 0..(span_s / CYCLE_S).round() as usize {
            self.q[6] += speed_rad_s * CYCLE_S;
            self.send(&Command::ServoJoint(self.q));
            self.wait(CYCLE_S);
        }
    }

    /// The status byte of the newest reply.
    pub fn status(&self) -> Status {
        Status(self.replies.last().unwrap().status)
    }

    pub fn errors(&self) -> Vec<u8> {
        let error = |e: &TimedEvent| match e.event {
            ArmEvent::Error(ErrorCode(code)) => Some(code),
            _ => None,
        };
        self.events.iter().filter_map(error).collect()
    }

    /// When the faults began and ended, since the start (ms).
    pub fn fault_times(&self) -> Vec<(u64, bool)> {
        let times = |e: &TimedEvent| match e.event {
            ArmEvent::Fault { begins, .. } => Some(((e.at.0 - START.0) / 1_000_000, begins)),
            _ => None,
        };
        self.events.iter().filter_map(times).collect()
    }
}
