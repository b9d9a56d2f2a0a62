//! Where the arm's joints were, as far back as the preview needs it.

use std::collections::VecDeque;

use arm_model::{JointVector, Pole};
use rope_sim::{MeasuredArm, MotionError};
use shared_types::MonotonicNs;

/// The arm stands while all joints stay within this of where they were (rad): ten times
/// the encoders' noise.
const STILL_RAD: f64 = 1e-3;
/// Least time between two reports that are kept (ns).
const SPACING_NS: u64 = 2_000_000;
/// A silence after which the arm may be anywhere (ns), and how far from where it was a
/// joint must be to count as moved meanwhile (rad).
const SILENCE_NS: u64 = 300_000_000;
const MOVED_RAD: f64 = 0.01;
/// No joint is that fast (rad/s).
const TOO_FAST_RAD_S: f64 = 10.0;
/// Most reports kept: more than two minutes.
const MAX_REPORTS: usize = 1 << 15;

/// Measured joints (CLOCK_MONOTONIC, ns).
#[derive(Debug, Clone, Copy)]
struct Report {
    stamp_ns: u64,
    q: JointVector,
}

impl Report {
    fn off_rad(&self, other: &Self) -> f64 {
        (self.q - other.q).max_abs()
    }
}

/// The arm's recent past.
#[derive(Debug)]
pub(super) struct Arm {
    pole: Pole,
    reports: VecDeque<Report>,
    /// Since when, and where, the arm stands.
    stands: Option<Report>,
    jumped: bool,
}

impl Arm {
    pub(super) fn new(pole: Pole) -> Self {
        Self {
            pole,
            reports: VecDeque::new(),
            stands: None,
            jumped: false,
        }
    }

    /// Takes in measured joints. What is no pose or not later than the last is left out.
    pub(super) fn put(&mut self, stamp_ns: u64, q: JointVector) {
        let new = Report { stamp_ns, q };
        let last = self.reports.back();
        if !q.is_finite() || last.is_some_and(|last| stamp_ns < last.stamp_ns + SPACING_NS) {
            return;
        }
        if let Some(last) = last {
            let since_s = MonotonicNs(stamp_ns).since_s(MonotonicNs(last.stamp_ns));
            let unseen = stamp_ns - last.stamp_ns > SILENCE_NS;
            let way_rad = new.off_rad(last);
            if way_rad > MOVED_RAD && (unseen || way_rad > TOO_FAST_RAD_S * since_s) {
                self.reports.clear();
                self.jumped = true;
            }
        }
        if self.stands.is_none_or(|at| new.off_rad(&at) > STILL_RAD) {
            self.stands = Some(new);
        }
        self.reports.push_back(new);
        // Whoever needs the past asks before it is full.
        while self.reports.len() > MAX_REPORTS {
            self.reports.pop_front();
        }
    }

    /// Whether the arm is somewhere else than its path leads to, since this was last asked.
    pub(super) fn take_jump(&mut self) -> bool {
        std::mem::take(&mut self.jumped)
    }

    /// Whether it is known where the arm was at an instant, or a moment before.
    pub(super) fn is_known_at(&self, stamp_ns: u64) -> bool {
        let last = self.reports.back();
        last.is_some_and(|last| stamp_ns <= last.stamp_ns.saturating_add(SILENCE_NS))
    }

    /// Since when the arm has stood where it is.
    pub(super) fn stands_since_ns(&self) -> Option<u64> {
        self.stands.map(|report| report.stamp_ns)
    }

    /// Stamp of the newest report; 0 before the first.
    pub(super) fn newest_ns(&self) -> u64 {
        self.reports.back().map_or(0, |report| report.stamp_ns)
    }

    /// Whether the oldest reports are about to be forgotten.
    pub(super) fn is_full(&self) -> bool {
        self.reports.len() >= MAX_REPORTS
    }

    /// Farthest that any joint has been from where it was at the oldest report (rad).
    pub(super) fn reach_rad(&self) -> f64 {
        let first = self.reports.front();
        let off = |first: &Report| {
            let all = self.reports.iter().map(|report| report.off_rad(first));
            all.fold(0.0, f64::max)
        };
        first.map_or(0.0, off)
    }

    /// Forgets what was before an instant.
    pub(super) fn forget_before(&mut self, stamp_ns: u64) {
        let old = self.reports.partition_point(|r| r.stamp_ns < stamp_ns);
        self.reports.drain(..old);
    }

    /// The motion since the oldest report, time 0 at `zero_ns`; it comes to rest at the end.
    pub(super) fn motion(&self, zero_ns: u64) -> Result<MeasuredArm, MotionError> {
        let t_s = |r: &Report| MonotonicNs(r.stamp_ns).since_s(MonotonicNs(zero_ns));
        let (times_s, q): (Vec<_>, Vec<_>) = self.reports.iter().map(|r| (t_s(r), r.q)).unzip();
        MeasuredArm::new(&times_s, &q, self.pole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::joint::START_POSE;

    const MS: u64 = 1_000_000;

    fn arm() -> Arm {
        Arm::new(Pole::default())
    }

    fn at(rad: f64) -> JointVector {
        let mut q = START_POSE;
        q[5] += rad;
        q
    }

    #[test]
    fn rest_is_told_from_motion_and_what_is_kept_is_bounded() {
        let mut arm = arm();
        for k in 0..100_u64 {
            // The encoders' noise.
            arm.put((1 + 4 * k) * MS, at(1e-4 * (k % 3) as f64));
        }
        assert_eq!(arm.stands_since_ns(), Some(MS));
        for k in 100..40_000_u64 {
            arm.put((1 + 4 * k) * MS, at(0.2 * (0.004 * k as f64).sin()));
        }
        assert!(arm.stands_since_ns() > Some(159_900 * MS));
        assert!(arm.is_full() && arm.reports.len() == MAX_REPORTS);
        assert!((0.2..0.41).contains(&arm.reach_rad()));
        arm.forget_before(159_000 * MS);
        let motion = arm.motion(159_000 * MS).unwrap();
        let off = motion.joints_at(0.5).q - at(0.2 * (159.499_f64).sin());
        assert!(off.max_abs() < 1e-5, "{off:?}");
    }

    #[test]
    fn a_pose_that_no_way_leads_to_is_a_jump_and_a_short_silence_is_none() {
        let mut arm = arm();
        arm.put(0, at(0.0));
        arm.put(0, at(1.0));
        assert!(!arm.take_jump(), "not later: left out");
        arm.put(200 * MS, at(0.3));
        assert!(!arm.take_jump(), "one and a half radians a second");
        arm.put(900 * MS, at(0.305));
        assert!(!arm.take_jump(), "it stood meanwhile");
        arm.put(1600 * MS, at(0.4));
        assert!(arm.take_jump() && !arm.take_jump());
        assert_eq!(arm.reports.len(), 1);
        arm.put(1604 * MS, at(0.6));
        assert!(arm.take_jump(), "fifty radians a second");
    }

    #[test]
    fn where_the_arm_is_counts_for_a_moment_after_the_last_report() {
        let mut arm = arm();
        assert!(!arm.is_known_at(0));
        arm.put(1000 * MS, JointVector::splat(f64::NAN));
        assert!(!arm.is_known_at(0));
        arm.put(1000 * MS, at(0.0));
        assert!(arm.is_known_at(500 * MS) && arm.is_known_at(1300 * MS));
        assert!(!arm.is_known_at(1301 * MS));
    }
}
