//! Whether what was sent, and what the arm did, kept every limit.
//!
//! Knows nothing of the limiter: divided differences over the instants the
//! setpoints were for, and over those at which they reached the arm.

use super::stage::Stage;
use arm_model::{JOINTS, JointVector, Limits, kinematics};
use rt_controller::control::ControlEvent;
use shared_types::{CommandInterface, MonotonicNs};

/// Smallest time between two setpoints (s): 0.8 of a cycle.
const GAP_MIN_S: f64 = 0.0032;
/// What rounding leaves of speed, acceleration and jerk.
const EXACT: [f64; 3] = [1e-9, 1e-8, 1e-5];
/// The same where positions travelled as 32-bit floats.
const ON_THE_WIRE: [f64; 3] = [2e-4, 0.2, 200.0];

/// The last four setpoints, newest first.
struct Differences {
    last: [(u64, JointVector); 4],
    rounding: [f64; 3],
    /// By how much an arrival may be beside the instant it was meant for (s);
    /// then speeds are judged, not what two divisions make of the jitter.
    jitter_s: f64,
}

impl Differences {
    fn at_rest(at: MonotonicNs, q: JointVector, rounding: [f64; 3], jitter_s: f64) -> Self {
        let before = |cycles: f64| (at.plus_s(-0.004 * cycles).0, q);
        Self {
            last: [before(1.0), before(2.0), before(3.0), before(4.0)],
            rounding,
            jitter_s,
        }
    }

    /// Asserts that the setpoint for (or arriving at) `at` keeps every limit.
    fn take(&mut self, at: MonotonicNs, q: JointVector, limits: &Limits) {
        self.last = [(at.0, q), self.last[0], self.last[1], self.last[2]];
        let span = |a: usize, b: usize| (self.last[a].0 - self.last[b].0) as f64 * 1e-9;
        let gap_s = span(0, 1) + self.jitter_s;
        assert!(gap_s > GAP_MIN_S - 1e-9, "{gap_s} s apart");
        let first = |a: usize| (self.last[a].1 - self.last[a + 1].1) * (1.0 / span(a, a + 1));
        let second = |a: usize| (first(a) - first(a + 1)) * (2.0 / span(a, a + 2));
        let third = (second(0) - second(1)) * (3.0 / span(0, 3));
        let period_s = limits.period_s();
        for j in 0..JOINTS {
            let check = |what: &str, value: f64, most: f64, slack: f64| {
                let most = most * (1.0 + 1e-9) + slack;
                assert!(
                    value.abs() <= most,
                    "joint {}: {what} {value} of {most}",
                    j + 1
                );
            };
            let (low, high) = (limits.position_min_rad[j], limits.position_max_rad[j]);
            check(
                "position",
                q[j] - 0.5 * (low + high),
                0.5 * (high - low),
                1e-6,
            );
            let acceleration = limits.acceleration_max_rad_s2[j];
            let speed = first(0)[j] * span(0, 1) / gap_s;
            check(
                "speed",
                speed,
                limits.velocity_max_rad_s[j],
                self.rounding[0],
            );
            if self.jitter_s > 0.0 {
                continue;
            }
            check("acceleration", second(0)[j], acceleration, self.rounding[1]);
            // A clamped spline may step its acceleration at its ends.
            let jerk = limits.jerk_max_rad_s3[j] + acceleration / period_s;
            check("jerk", third[j], jerk, self.rounding[2]);
        }
        let way_m = (tool(&q, limits) - tool(&self.last[1].1, limits)).norm();
        let speed_m_s = way_m / gap_s;
        let most = limits.tcp_speed_max_m_s + 2.0 * self.rounding[0];
        assert!(speed_m_s <= most, "tool at {speed_m_s} m/s");
        let step_m = 0.010 * (gap_s / period_s).max(1.0);
        assert!(way_m <= step_m + 1e-6, "tool step of {way_m} m");
    }
}

fn tool(q: &JointVector, limits: &Limits) -> nalgebra::Vector3<f64> {
    let (p, r) = kinematics::flange_pose(q);
    p + r * limits.tcp_offset()
}

/// Asserts every limit over all setpoints so far, as computed; and over those
/// that reached the arm before `wire_until`, as it got them.
pub(crate) fn assert_kept(stage: &Stage, wire_until: MonotonicNs) {
    assert_all(stage, wire_until, 0.0);
}

/// The same where commands may arrive `jitter_s` beside the instant they were
/// meant for.
pub(crate) fn assert_kept_with_jitter(stage: &Stage, jitter_s: f64) {
    assert_all(stage, MonotonicNs(u64::MAX), jitter_s);
}

fn assert_all(stage: &Stage, wire_until: MonotonicNs, jitter_s: f64) {
    assert_computed(stage);
    match stage.via {
        CommandInterface::ServoPosition => assert_arrived(stage, wire_until, jitter_s),
        CommandInterface::JointVelocity => assert_velocities(stage, wire_until, jitter_s),
    }
    assert_true_motion(stage);
}

fn assert_computed(stage: &Stage) {
    let limits = Limits::default();
    let log = &stage.rig.log;
    let engaged: Vec<u64> = log
        .events
        .iter()
        .filter(|(_, event)| matches!(event, ControlEvent::Engaged))
        .map(|(cycle, _)| *cycle)
        .collect();
    let mut differences = None;
    for (record, input) in log.records.iter().zip(&log.inputs) {
        let at = MonotonicNs(record.deadline_ns + u64::from(input.late_ns));
        if engaged.contains(&record.cycle) {
            differences = Some(Differences::at_rest(at, record.q_c, EXACT, 0.0));
        }
        if record.sent == 1 {
            let judge: &mut Differences = differences.as_mut().expect("sent before an engagement");
            judge.take(at, record.q_c, &limits);
        }
    }
}

/// A longer pause between two arrivals begins a new stream: the arm was taken
/// over anew.
const PAUSE_S: f64 = 0.1;

fn assert_arrived(stage: &Stage, until: MonotonicNs, jitter_s: f64) {
    let limits = Limits::default();
    let mut differences: Option<Differences> = None;
    for (at, q) in stage.arrivals().into_iter().filter(|(at, _)| *at < until) {
        let anew = differences
            .as_ref()
            .is_none_or(|d| at.since_s(MonotonicNs(d.last[0].0)) > PAUSE_S);
        if anew {
            differences = Some(Differences::at_rest(at, q, ON_THE_WIRE, jitter_s));
        }
        if let Some(judge) = &mut differences {
            judge.take(at, q, &limits);
        }
    }
}

/// Velocities on the wire: joints, tool, and how fast they change.
fn assert_velocities(stage: &Stage, until: MonotonicNs, jitter_s: f64) {
    let limits = Limits::default();
    let mut before: Option<(MonotonicNs, JointVector)> = None;
    for (at, qd) in stage.arrivals().into_iter().filter(|(at, _)| *at < until) {
        let (last_at, last) = before
            .filter(|(last_at, _)| at.since_s(*last_at) < PAUSE_S)
            .unwrap_or((at.plus_s(-0.004), JointVector::ZERO));
        let span_s = at.since_s(last_at) + jitter_s;
        assert!(span_s > GAP_MIN_S - 1e-9, "{span_s} s apart");
        for j in 0..JOINTS {
            let most = limits.velocity_max_rad_s[j] * (1.0 + 1e-6);
            assert!(qd[j].abs() <= most, "joint {}: {} rad/s", j + 1, qd[j]);
            let change = (qd[j] - last[j]).abs() / span_s;
            let most = limits.acceleration_max_rad_s2[j] * (1.0 + 1e-6) + 1e-3;
            assert!(change <= most, "joint {}: {change} rad/s2", j + 1);
        }
        before = Some((at, qd));
    }
}

/// The joints themselves lag behind and ripple, but are hardly faster than what
/// they follow. After lost cycles, in which they came nearly to rest, they catch up
/// and are faster for a moment, the more the longer the gap was.
fn assert_true_motion(stage: &Stage) {
    let limits = Limits::default();
    let inputs = stage.rig.log.inputs.iter();
    let late = inputs.map(|i| i.missed + u32::from(i.late_ns > 0)).max();
    let part = match late {
        None | Some(0) => 1.05,
        Some(1..=2) => 1.25,
        Some(_) => 1.7,
    };
    for sample in &stage.rig.log.truth {
        let state = &sample.state;
        for j in 0..JOINTS {
            let most = limits.velocity_max_rad_s[j] * part;
            assert!(
                state.qd[j].abs() <= most,
                "joint {}: {} rad/s",
                j + 1,
                state.qd[j]
            );
        }
        let speed = kinematics::tool_speed_m_s(&state.q, &state.qd, &limits.tcp_offset());
        assert!(
            speed <= limits.tcp_speed_max_m_s * part,
            "tool at {speed} m/s"
        );
    }
}
