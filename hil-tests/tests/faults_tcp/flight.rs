//! What a stand has recorded, and what must hold of every flight.

use arm_model::{JOINTS, JointVector, Limits, Pole};
use hil_tests::setpoint_limits::assert_computed;
use rt_controller::recording::RecordedCycle;
use rt_controller::xarm::ArmState;
use shared_types::ipc::{CauseRecord, ControllerMode, CycleRecord};
use shared_types::{CommandInterface, FaultCode, MonotonicNs};
use xarm_sim::{ArmEvent, JointSample, TimedEvent};

/// Speed under which the arm stands (rad/s).
const STILL_RAD_S: f64 = 2e-3;
/// Client number of the arm's own second commander.
const SECOND_COMMANDER: u32 = u32::MAX;
/// A request by which a second commander gives itself away.
const FEEDBACK_CHECK: ArmEvent = ArmEvent::Request { register: 253 };

/// Everything that is known about the time of a stand.
#[derive(Debug, Default)]
pub struct Flight {
    pub limits: Limits,
    pub interface: CommandInterface,
    /// Every control cycle, in order.
    pub cycles: Vec<RecordedCycle>,
    /// Every record of a cause.
    pub causes: Vec<CauseRecord>,
    /// What the arm got and did.
    pub arm: Vec<TimedEvent>,
    /// True joint motion, 1 kHz.
    pub truth: Vec<JointSample>,
    /// For each stop, in order, the faults of which one must be its cause.
    pub expected: Vec<Vec<FaultCode>>,
    /// Times in which the arm must have stood still.
    pub at_rest: Vec<(MonotonicNs, MonotonicNs)>,
}

impl Flight {
    /// Sum of a count over all cycles.
    pub fn total(&self, count: impl Fn(&RecordedCycle) -> u32) -> u32 {
        self.cycles.iter().map(count).sum()
    }

    /// Largest speed of a pole's end in the controller's own moves, as commanded (m/s).
    pub fn pole_top_m_s(&self, pole: &Pole) -> f64 {
        let moving = |c: &&RecordedCycle| c.record.mode == ControllerMode::Moving as u8;
        let moved: Vec<_> = self.cycles.iter().filter(moving).collect();
        let end_m = |c: &RecordedCycle| pole.attach_pose(&c.record.q_c).0;
        // A setpoint that a busy machine sends late is for the instant at which it goes out.
        let at_ns = |c: &RecordedCycle| c.record.deadline_ns + u64::from(c.input.late_ns);
        let speeds_m_s = moved.windows(2).map(|pair| {
            let passed_ns = at_ns(pair[1]) - at_ns(pair[0]);
            (end_m(pair[1]) - end_m(pair[0])).norm() / (1e-9 * passed_ns as f64)
        });
        speeds_m_s.fold(0.0, f64::max)
    }

    /// Cycles whose setpoint went out.
    fn sent(&self) -> impl Iterator<Item = &RecordedCycle> {
        let went_out = |r: &CycleRecord| r.sent != 0 && !r.held_back();
        self.cycles.iter().filter(move |c| went_out(&c.record))
    }

    /// All that holds of every flight.
    pub fn check(&self) {
        self.one_cause_per_stop();
        self.nothing_is_sent_while_latched();
        let cycles = self.cycles.iter().map(|c| (&c.input, &c.record));
        assert_computed(&self.limits, cycles);
        self.the_arm_got_what_was_recorded();
        for (from, to) in &self.at_rest {
            let seen = self.truth.iter().filter(|s| s.at > *from && s.at < *to);
            let fastest = seen.map(|s| s.state.qd.max_abs()).fold(0.0, f64::max);
            assert!(fastest < STILL_RAD_S, "it moves at {fastest} rad/s");
        }
    }

    fn one_cause_per_stop(&self) {
        let causes: Vec<_> = self.causes.iter().map(CauseRecord::fault).collect();
        assert_eq!(causes.len(), self.expected.len(), "{causes:?}");
        for (cause, expected) in causes.iter().zip(&self.expected) {
            assert!(expected.contains(cause), "{causes:?}: {expected:?}");
        }
    }

    /// From the cycle in which a stop ends until the arm is engaged again.
    fn nothing_is_sent_while_latched(&self) {
        for pair in self.cycles.windows(2) {
            let (before, now) = (&pair[0].record, &pair[1].record);
            let latched = |r: &CycleRecord| r.mode == ControllerMode::Faulted as u8;
            assert!(
                !(latched(before) && latched(now) && now.sent != 0),
                "cycle {} sent a setpoint",
                now.cycle
            );
        }
    }

    /// What reached the arm is what the cycles sent, in order, nothing twice.
    fn the_arm_got_what_was_recorded(&self) {
        let mut sent = self.sent().map(|c| match self.interface {
            CommandInterface::ServoPosition => on_the_wire(&c.record.q_c),
            CommandInterface::JointVelocity => on_the_wire(&c.record.qd_sent),
        });
        for event in &self.arm {
            let (ArmEvent::Setpoint(got) | ArmEvent::Velocity { qd: got, .. }) = event.event else {
                continue;
            };
            if self.is_foreign(event) {
                continue;
            }
            assert!(
                sent.any(|wanted| wanted == on_the_wire(&got)),
                "the arm got {got:?}, which no cycle sent then"
            );
        }
    }

    /// Whether something came from a second commander: the arm's own, or a client
    /// that gave itself away by the one request nobody else makes.
    fn is_foreign(&self, event: &TimedEvent) -> bool {
        let owned_up = |e: &TimedEvent| e.event == FEEDBACK_CHECK && e.client == event.client;
        event.client == Some(SECOND_COMMANDER) || self.arm.iter().any(owned_up)
    }
}

/// Whether the arm's state became "stopped".
pub fn was_stopped(it: &TimedEvent) -> bool {
    let stopped = ArmState::Stopped;
    matches!(it.event, ArmEvent::State { state, .. } if state == stopped)
}

/// As the wire carries it: 32 bits.
fn on_the_wire(q: &JointVector) -> [u32; JOINTS] {
    #[allow(clippy::cast_possible_truncation, reason = "as the wire does")]
    core::array::from_fn(|j| (q[j] as f32).to_bits())
}
