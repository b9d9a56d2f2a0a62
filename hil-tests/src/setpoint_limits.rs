//! Whether setpoints kept every limit.
//!
//! Knows nothing of the limiter: divided differences over the instants the setpoints were
//! for, or over those at which they reached the arm.

use arm_model::{JOINTS, JointVector, Limits};
use shared_types::MonotonicNs;
use shared_types::ipc::{CommandKind, ControllerMode, CycleRecord, InputRecord};

/// Smallest time between two setpoints (s): 0.8 of a cycle.
pub const GAP_MIN_S: f64 = 0.0032;
/// What rounding leaves of speed, acceleration and jerk.
const EXACT: [f64; 3] = [1e-9, 1e-8, 1e-5];

/// The last four setpoints, newest first, and what they are judged by.
#[derive(Debug)]
pub struct Differences {
    last: [(u64, JointVector); 4],
    rounding: [f64; 3],
    /// By how much an arrival may be beside the instant it was meant for (s);
    /// then speeds are judged, not what two divisions make of the jitter.
    jitter_s: f64,
}

impl Differences {
    /// An arm at rest in `q` before `at`. Speeds, accelerations and jerks may exceed their
    /// limits by `rounding` (rad/s, rad/s², rad/s³).
    #[must_use]
    pub fn at_rest(at: MonotonicNs, q: JointVector, rounding: [f64; 3], jitter_s: f64) -> Self {
        let before = |cycles: f64| (at.plus_s(-0.004 * cycles).0, q);
        Self {
            last: [before(1.0), before(2.0), before(3.0), before(4.0)],
            rounding,
            jitter_s,
        }
    }

    /// Instant of the newest setpoint.
    #[must_use]
    pub fn newest(&self) -> MonotonicNs {
        MonotonicNs(self.last[0].0)
    }

    /// Asserts that the setpoint for (or arriving at) `at` keeps every limit.
    ///
    /// # Panics
    /// When it does not.
    pub fn take(&mut self, at: MonotonicNs, q: JointVector, limits: &Limits) {
        self.last = [(at.0, q), self.last[0], self.last[1], self.last[2]];
        let span = |a: usize, b: usize| (self.last[a].0 - self.last[b].0) as f64 * 1e-9;
        let gap_s = span(0, 1) + self.jitter_s;
        assert!(gap_s > GAP_MIN_S - 1e-9, "{gap_s} s apart");
        let first = |a: usize| (self.last[a].1 - self.last[a + 1].1) * (1.0 / span(a, a + 1));
        let second = |a: usize| (first(a) - first(a + 1)) * (2.0 / span(a, a + 2));
        let third = (second(0) - second(1)) * (3.0 / span(0, 3));
        let period_s = limits.period_s();
        for j in 0..JOINTS {
            let joint = j + 1;
            let check = |what: &str, value: f64, most: f64, slack: f64| {
                let most = most * (1.0 + 1e-9) + slack;
                assert!(
                    value.abs() <= most,
                    "joint {joint}: {what} {value} of {most}"
                );
            };
            let (low, high) = (limits.position_min_rad[j], limits.position_max_rad[j]);
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
            check("position", q[j] - middle, half, 1e-6);
            let fastest = limits.velocity_max_rad_s[j];
            let acceleration = limits.acceleration_max_rad_s2[j];
            let speed = first(0)[j] * span(0, 1) / gap_s;
            check("speed", speed, fastest, self.rounding[0]);
            if self.jitter_s > 0.0 {
                continue;
            }
            check("acceleration", second(0)[j], acceleration, self.rounding[1]);
            // A clamped spline may step its acceleration at its ends.
            let jerk = limits.jerk_max_rad_s3[j] + acceleration / period_s;
            check("jerk", third[j], jerk, self.rounding[2]);
        }
        let tool = |q: &JointVector| limits.tool_centre_point_m(q);
        let way_m = (tool(&q) - tool(&self.last[1].1)).norm();
        let speed_m_s = way_m / gap_s;
        let most = limits.tcp_speed_max_m_s + 2.0 * self.rounding[0];
        assert!(speed_m_s <= most, "tool at {speed_m_s} m/s");
        let step_m = 0.010 * (gap_s / period_s).max(1.0);
        assert!(way_m <= step_m + 1e-6, "tool step of {way_m} m");
    }
}

/// Asserts every limit over the setpoints that went out, as they were computed. Where the
/// controller engages the arm, it stands.
///
/// One that was held back, because its cycle was held up before the send, may lie close
/// before the next; the arm never received it.
///
/// # Panics
/// When a setpoint does not keep a limit, or was held back without being counted.
pub fn assert_computed<'a>(
    limits: &Limits,
    cycles: impl IntoIterator<Item = (&'a InputRecord, &'a CycleRecord)>,
) {
    let (mut judge, mut before) = (None, ControllerMode::Offline as u8);
    let (mut held_back, mut missed) = (0, 0);
    for (input, record) in cycles {
        let at = MonotonicNs(record.deadline_ns + u64::from(input.late_ns));
        let engages = input.command.kind == CommandKind::Engage as u8;
        // Elsewhere an engagement is refused, and what moves goes on.
        let stood = [ControllerMode::Offline, ControllerMode::Faulted].map(|mode| mode as u8);
        if engages && stood.contains(&before) && record.mode == ControllerMode::Idle as u8 {
            judge = Some(Differences::at_rest(at, record.q_c, EXACT, 0.0));
        }
        before = record.mode;
        held_back += u32::from(record.held_back());
        missed += record.missed;
        if record.sent == 1 && !record.held_back() {
            assert!(judge.is_some(), "sent before an engagement");
            judge
                .iter_mut()
                .for_each(|judge| judge.take(at, record.q_c, limits));
        }
    }
    // The cycle after it counts it as missed; there may be none after the last.
    assert!(held_back <= missed + 1, "{held_back} of {missed} missed");
}
