//! Where the clamp was, as far back as the preview needs it.
//!
//! Reports come 250 times a second, for hours. A knot is kept where the clamp moved and at
//! both ends of a time in which it stood, so that what is kept grows with motion only.

use std::collections::VecDeque;

use arm_model::{JointVector, Pole};
use nalgebra::Vector3;
use shared_types::MonotonicNs;

use crate::track::{ClampError, ClampPath, ClampSample};

/// The clamp stands while it stays within this of a knot (m): above the encoders' last
/// digits, a tenth of a pixel at a metre.
const STILL_M: f64 = 5e-4;
/// The same for the direction of the pole (rad).
const STILL_RAD: f64 = 2e-3;
/// Least time between two knots (ns), but for the newest.
const SPACING_NS: u64 = 8_000_000;
/// A silence after which the clamp may be anywhere (ns), and how far from where it was it
/// must be to count as moved meanwhile (m).
const SILENCE_NS: u64 = 300_000_000;
const MOVED_M: f64 = 0.01;
/// No arm is that fast (m/s).
const TOO_FAST_M_S: f64 = 10.0;
/// Most knots: half a minute of motion.
const MOST: usize = 4096;

/// The clamp at one time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Knot {
    pub(super) stamp_ns: u64,
    pub(super) p_w_m: Vector3<f64>,
    pole_w: Vector3<f64>,
}

impl Knot {
    /// From measured joints (CLOCK_MONOTONIC ns, rad); `None` for what is no pose.
    pub(super) fn of_joints(stamp_ns: u64, q: &JointVector, pole: &Pole) -> Option<Self> {
        if !q.is_finite() {
            return None;
        }
        let (p_w_m, r) = pole.attach_pose(q);
        Some(Self::new(stamp_ns, p_w_m, r.column(2).into()))
    }

    pub(super) fn new(stamp_ns: u64, p_w_m: Vector3<f64>, pole_w: Vector3<f64>) -> Self {
        Self {
            stamp_ns,
            p_w_m,
            pole_w,
        }
    }

    fn stands_at(&self, other: &Self) -> bool {
        (self.p_w_m - other.p_w_m).norm() < STILL_M
            && (self.pole_w - other.pole_w).norm() < STILL_RAD
    }
}

/// The clamp's path.
#[derive(Debug, Default)]
pub(super) struct Arm {
    knots: VecDeque<Knot>,
    jumped: bool,
}

impl Arm {
    /// Takes in the clamp's newest pose. One that is not later than the last is left out.
    pub(super) fn put(&mut self, new: Knot) {
        if let Some(last) = self.knots.back().copied() {
            if new.stamp_ns <= last.stamp_ns {
                return;
            }
            let way_m = (new.p_w_m - last.p_w_m).norm();
            let since_s = MonotonicNs(new.stamp_ns).since_s(MonotonicNs(last.stamp_ns));
            let unseen = new.stamp_ns - last.stamp_ns > SILENCE_NS;
            if way_m > MOVED_M && (unseen || way_m > TOO_FAST_M_S * since_s) {
                self.knots.clear();
                self.jumped = true;
            }
        }
        if let Some(before) = self.knots.len().checked_sub(2).map(|i| self.knots[i]) {
            let last = self.knots[self.knots.len() - 1];
            let stands = last.stands_at(&before) && new.stands_at(&before);
            if stands || last.stamp_ns - before.stamp_ns < SPACING_NS {
                self.knots.pop_back();
            }
        }
        self.knots.push_back(new);
        // Whoever needs the past asks before it is full.
        while self.knots.len() > MOST {
            self.knots.pop_front();
        }
    }

    /// Whether the clamp is somewhere else than its path leads to, since this was last asked.
    pub(super) fn take_jump(&mut self) -> bool {
        std::mem::take(&mut self.jumped)
    }

    /// Whether it is known where the clamp was at an instant, or a moment before.
    pub(super) fn is_known_at(&self, stamp_ns: u64) -> bool {
        let last = self.knots.back();
        last.is_some_and(|last| stamp_ns <= last.stamp_ns.saturating_add(SILENCE_NS))
    }

    /// The newest pose.
    pub(super) fn newest(&self) -> Option<&Knot> {
        self.knots.back()
    }

    /// How long the clamp has stood where it is (ns).
    pub(super) fn stood_ns(&self) -> u64 {
        let Some(before) = self.knots.len().checked_sub(2).map(|i| self.knots[i]) else {
            return 0;
        };
        let last = self.knots[self.knots.len() - 1];
        if last.stands_at(&before) {
            last.stamp_ns - before.stamp_ns
        } else {
            0
        }
    }

    /// Whether the oldest knots are about to be forgotten.
    pub(super) fn is_full(&self) -> bool {
        self.knots.len() >= MOST
    }

    /// Forgets what was before an instant, but for the knot that leads to it.
    pub(super) fn forget_before(&mut self, stamp_ns: u64) {
        while self.knots.len() > 2 && self.knots[1].stamp_ns <= stamp_ns {
            self.knots.pop_front();
        }
    }

    /// The path, time 0 at `zero_ns`.
    pub(super) fn since(&self, zero_ns: u64) -> Result<ClampPath, ClampError> {
        let samples = self.knots.iter().map(|knot| ClampSample {
            t_s: MonotonicNs(knot.stamp_ns).since_s(MonotonicNs(zero_ns)),
            p_w_m: knot.p_w_m,
            pole_w: knot.pole_w,
        });
        ClampPath::new(samples.collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn knot(ms: u64, x: f64) -> Knot {
        Knot::new(ms * MS, Vector3::new(x, 0.0, 0.8), Vector3::z())
    }

    #[test]
    fn an_arm_that_stands_takes_no_room_and_one_that_moves_is_followed() {
        let mut arm = Arm::default();
        for k in 0..100_000 {
            // The encoders' noise.
            arm.put(knot(4 * k, 1e-5 * f64::from((k % 3) as u8)));
        }
        assert_eq!(arm.knots.len(), 2);
        assert_eq!(arm.stood_ns(), 399_996 * MS);
        let x = |ms: u64| 0.1 * (ms as f64 * 1e-3 * 6.0).sin();
        for k in 0..500 {
            arm.put(knot(400_000 + 4 * k, x(4 * k)));
        }
        assert_eq!(arm.stood_ns(), 0);
        assert!(arm.knots.len() < 260, "{}", arm.knots.len());
        let path = arm.since(400_000 * MS).unwrap();
        for ms in 0..1990_u64 {
            let off = (path.at(ms as f64 * 1e-3).p_w_m.x - x(ms)).abs();
            assert!(off < 1e-3, "{off} m off at {ms} ms");
        }
        // It hung still where it stood.
        assert!(path.at(-300.0).p_w_m.x.abs() < 5e-5);
        arm.forget_before(401_000 * MS);
        let path = arm.since(400_000 * MS).unwrap();
        assert!((path.at(1.0).p_w_m.x - x(1000)).abs() < 1e-3);
        assert!(path.samples()[0].t_s > 0.98);
    }

    #[test]
    fn what_is_kept_is_bounded() {
        let mut arm = Arm::default();
        for k in 0..20_000_u64 {
            arm.put(knot(8 * k, 1e-3 * k as f64));
        }
        assert!(arm.is_full());
        assert_eq!(arm.knots.len(), MOST);
    }

    #[test]
    fn a_pose_that_no_way_leads_to_is_a_jump_and_a_short_silence_is_none() {
        let mut arm = Arm::default();
        arm.put(knot(0, 0.0));
        arm.put(knot(0, 5.0));
        assert!(!arm.take_jump(), "not later: left out");
        arm.put(knot(200, 0.3));
        assert!(!arm.take_jump(), "one and a half metres a second");
        arm.put(knot(900, 0.305));
        assert!(!arm.take_jump(), "it stood meanwhile");
        arm.put(knot(1600, 0.4));
        assert!(arm.take_jump() && !arm.take_jump());
        assert_eq!(arm.knots.len(), 1);
        arm.put(knot(1604, 0.6));
        assert!(arm.take_jump(), "fifty metres a second");
    }

    #[test]
    fn where_the_arm_is_counts_for_a_moment_after_the_last_report() {
        let mut arm = Arm::default();
        assert!(!arm.is_known_at(0) && arm.newest().is_none());
        arm.put(knot(1000, 0.0));
        assert!(arm.is_known_at(500 * MS) && arm.is_known_at(1300 * MS));
        assert!(!arm.is_known_at(1301 * MS));
        let broken = JointVector::splat(f64::NAN);
        assert!(Knot::of_joints(0, &broken, &Pole::default()).is_none());
    }
}
