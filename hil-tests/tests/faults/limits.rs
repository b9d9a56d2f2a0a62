//! Whether what was sent, and what the arm did, kept every limit: as computed, over the
//! instants at which it reached the arm, and in the motion of the joints.

use super::stage::Stage;
use arm_model::{JOINTS, JointVector, Limits, kinematics};
use hil_tests::setpoint_limits::{Differences, GAP_MIN_S, assert_computed};
use shared_types::{CommandInterface, MonotonicNs};

/// What rounding leaves of speed, acceleration and jerk where positions travelled as 32-bit
/// floats.
const ON_THE_WIRE: [f64; 3] = [2e-4, 0.2, 200.0];

/// No moment: what arrives at any time counts.
pub(crate) const EVER: MonotonicNs = MonotonicNs(u64::MAX);

/// Asserts every limit over all setpoints so far, as computed; and over those that reached
/// the arm before `wire_until`, as it got them, up to `jitter_s` beside the instant they
/// were meant for.
pub(crate) fn assert_kept(stage: &Stage, wire_until: MonotonicNs, jitter_s: f64) {
    let log = &stage.rig.log;
    assert_computed(&Limits::default(), log.inputs.iter().zip(&log.records));
    match stage.via {
        CommandInterface::ServoPosition => assert_arrived(stage, wire_until, jitter_s),
        CommandInterface::JointVelocity => assert_velocities(stage, wire_until, jitter_s),
    }
    assert_true_motion(stage);
}

/// A longer pause between two arrivals begins a new stream: the arm was taken
/// over anew.
const PAUSE_S: f64 = 0.1;

fn assert_arrived(stage: &Stage, until: MonotonicNs, jitter_s: f64) {
    let limits = Limits::default();
    let mut differences: Option<Differences> = None;
    for (at, q) in stage.rig.log.arrivals().filter(|(at, _)| *at < until) {
        let anew = differences
            .as_ref()
            .is_none_or(|judge| at.since_s(judge.newest()) > PAUSE_S);
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
    for (at, qd) in stage.rig.log.arrivals().filter(|(at, _)| *at < until) {
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
