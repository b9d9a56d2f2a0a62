//! What a stand has recorded, and what must hold of every flight.

use arm_model::{JOINTS, JointVector, Limits, kinematics};
use rt_controller::recording::RecordedCycle;
use shared_types::ipc::{CauseRecord, ControllerMode, CycleRecord};
use shared_types::{CommandInterface, FaultCode, MonotonicNs};
use xarm_sim::{ArmEvent, JointSample, TimedEvent};

/// Speed under which the arm stands (rad/s).
const STILL_RAD_S: f64 = 2e-3;
/// Rounding of the numbers compared, as a part.
const ROUNDING: f64 = 1e-6;
/// Client number of the arm's own second commander.
const SECOND_COMMANDER: u32 = u32::MAX;
/// A request by which a second commander gives itself away.
const FEEDBACK_CHECK: ArmEvent = ArmEvent::Request { register: 253 };

/// Everything that is known about the time of a stand.
#[derive(Debug)]
pub struct Flight {
    limits: Limits,
    interface: CommandInterface,
    /// Every control cycle, in order.
    pub cycles: Vec<RecordedCycle>,
    /// Every record of a cause.
    pub causes: Vec<CauseRecord>,
    /// What the arm got and did.
    pub arm: Vec<TimedEvent>,
    /// True joint motion, 1 kHz.
    pub truth: Vec<JointSample>,
    expected: Vec<Vec<FaultCode>>,
    at_rest: Vec<(MonotonicNs, MonotonicNs)>,
}

impl Default for Flight {
    fn default() -> Self {
        Self::new(Limits::default(), CommandInterface::default())
    }
}

impl Flight {
    pub fn new(limits: Limits, interface: CommandInterface) -> Self {
        Self {
            limits,
            interface,
            cycles: Vec::new(),
            causes: Vec::new(),
            arm: Vec::new(),
            truth: Vec::new(),
            expected: Vec::new(),
            at_rest: Vec::new(),
        }
    }

    /// A stop for one of `faults` must have been recorded next.
    pub fn expect(&mut self, faults: &[FaultCode]) {
        self.expected.push(faults.to_vec());
    }

    /// The arm must have stood still in this time.
    pub fn at_rest_between(&mut self, from: MonotonicNs, to: MonotonicNs) {
        self.at_rest.push((from, to));
    }

    /// Sum of a count over all cycles.
    pub fn total(&self, count: impl Fn(&RecordedCycle) -> u32) -> u32 {
        self.cycles.iter().map(count).sum()
    }

    /// Cycles that sent a setpoint.
    fn sent(&self) -> impl Iterator<Item = &RecordedCycle> {
        self.cycles.iter().filter(|c| c.record.sent != 0)
    }

    /// All that holds of every flight.
    pub fn check(&self) {
        self.one_cause_per_stop();
        self.nothing_is_sent_while_latched();
        self.setpoints_keep_the_limits();
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

    /// Divided differences of the setpoints over their own instants: a path that
    /// keeps its limits keeps them, whatever cycles were missed.
    fn setpoints_keep_the_limits(&self) {
        let sent: Vec<_> = self.sent().collect();
        let runs = sent.chunk_by(|a, b| {
            // An engagement begins anew where the arm stands.
            seconds(a, b) < 0.5 && a.record.mode != ControllerMode::Faulted as u8
        });
        for run in runs {
            for pair in run.windows(2) {
                self.keeps_speed(pair[0], pair[1]);
            }
            for three in run.windows(3) {
                self.keeps_acceleration(three);
            }
        }
    }

    fn keeps_speed(&self, a: &RecordedCycle, b: &RecordedCycle) {
        let span_s = seconds(a, b);
        let (a, b) = (&a.record.q_c, &b.record.q_c);
        let tool = |q: &JointVector| {
            let (p_w_m, r_w) = kinematics::flange_pose(q);
            p_w_m + r_w * self.limits.tcp_offset()
        };
        let tool_m_s = (tool(b) - tool(a)).norm() / span_s;
        let most_m_s = self.limits.tcp_speed_max_m_s;
        assert!(tool_m_s <= most_m_s * (1.0 + ROUNDING), "{tool_m_s} m/s");
        for j in 0..JOINTS {
            let speed = (b[j] - a[j]).abs() / span_s;
            let most = self.limits.velocity_max_rad_s[j];
            assert!(speed <= most * (1.0 + ROUNDING), "joint {j}: {speed} rad/s");
        }
    }

    fn keeps_acceleration(&self, three: &[&RecordedCycle]) {
        let speed = |a: &RecordedCycle, b: &RecordedCycle, j: usize| {
            (b.record.q_c[j] - a.record.q_c[j]) / seconds(a, b)
        };
        let middle_s = 0.5 * seconds(three[0], three[2]);
        for j in 0..JOINTS {
            let change = speed(three[1], three[2], j) - speed(three[0], three[1], j);
            let found = (change / middle_s).abs();
            let most = self.limits.acceleration_max_rad_s2[j];
            assert!(
                found <= most * (1.0 + ROUNDING),
                "joint {j}: {found} rad/s² in cycle {}",
                three[2].record.cycle
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

/// Time between the instants that two setpoints are for: those of the deadlines,
/// or of the later ones at which they were really sent.
fn seconds(a: &RecordedCycle, b: &RecordedCycle) -> f64 {
    let instant = |c: &RecordedCycle| MonotonicNs(c.input.deadline_ns + u64::from(c.input.late_ns));
    instant(b).since_s(instant(a))
}

/// As the wire carries it: 32 bits.
fn on_the_wire(q: &JointVector) -> [u32; JOINTS] {
    #[allow(clippy::cast_possible_truncation, reason = "as the wire does")]
    core::array::from_fn(|j| (q[j] as f32).to_bits())
}
