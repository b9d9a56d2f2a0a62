//! The setpoints sent last, and when.

#![allow(
    clippy::arithmetic_side_effects,
    reason = "arithmetic of float vectors only; integers use wrapping calls"
)]

use arm_model::JointVector;
use serde::{Deserialize, Serialize};
use shared_types::MonotonicNs;

/// Setpoints remembered: 0.256 s at 250 Hz; no window may be longer than
/// [`TRACKING_WINDOW_MAX_MS`](crate::control::settings::TRACKING_WINDOW_MAX_MS). In
/// two halves, each as long as an array may be for serde.
const LENGTH: usize = 2 * HALF;
const HALF: usize = 32;

/// Fixed size, oldest overwritten. RT-safe.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Commanded {
    sent: [[(u64, JointVector); HALF]; 2],
    next: usize,
}

impl Commanded {
    /// Commanded to be in `q` for ever.
    #[must_use]
    pub const fn holding(q: JointVector) -> Self {
        Self {
            sent: [[(0, q); HALF]; 2],
            next: 0,
        }
    }

    /// A setpoint was sent.
    pub fn push(&mut self, deadline_ns: u64, q: JointVector) {
        if let Some(slot) = self.sent.as_flattened_mut().get_mut(self.next) {
            *slot = (deadline_ns, q);
        }
        self.next = self.next.wrapping_add(1) % LENGTH;
    }

    /// Least and largest of what was commanded of each joint between `from_ns` and `to_ns`, or
    /// just before (rad).
    #[must_use]
    pub fn bounds(&self, from_ns: u64, to_ns: u64) -> [JointVector; 2] {
        let (mut low, mut high) = (
            JointVector::splat(f64::INFINITY),
            JointVector::splat(f64::NEG_INFINITY),
        );
        let mut include = |c: &JointVector| {
            low = low.zip_with(*c, f64::min);
            high = high.zip_with(*c, f64::max);
        };
        for (at_ns, c) in self.newest_first() {
            if *at_ns <= to_ns || *at_ns < from_ns {
                include(c);
            }
            if *at_ns < from_ns {
                break;
            }
        }
        [low, high]
    }

    /// Setpoint of a joint (0-based) that was in force at `at_ns`: the newest sent by then (rad).
    #[must_use]
    pub fn in_force(&self, at_ns: u64, joint: usize) -> f64 {
        let mut oldest = None;
        for (sent_ns, q) in self.newest_first() {
            oldest = Some(q);
            if *sent_ns <= at_ns {
                break;
            }
        }
        oldest.map_or(0.0, |q| q[joint])
    }

    /// Setpoints are sent in the order of their times, so the ring is in order.
    fn newest_first(&self) -> impl Iterator<Item = &(u64, JointVector)> {
        let sent = self.sent.as_flattened();
        let (newer, older) = sent.split_at_checked(self.next).unwrap_or_default();
        newer.iter().rev().chain(older.iter().rev())
    }

    /// What was commanded at `at_ns`, linear between setpoints (rad).
    #[must_use]
    pub fn at(&self, at_ns: u64) -> JointVector {
        let mut after = None;
        let mut before = None;
        for entry in self.newest_first() {
            if entry.0 < at_ns {
                before = Some(entry);
                break;
            }
            after = Some(entry);
        }
        match (before, after) {
            (Some((t0, q0)), Some((t1, q1))) => {
                let span_s = MonotonicNs(*t1).since_s(MonotonicNs(*t0));
                let part = MonotonicNs(at_ns).since_s(MonotonicNs(*t0)) / span_s;
                *q0 + (*q1 - *q0) * part
            }
            (Some((_, q)), None) | (None, Some((_, q))) => *q,
            (None, None) => JointVector::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_setpoints_it_is_linear_and_outside_constant() {
        let mut history = Commanded::holding(JointVector::ZERO);
        for k in 0..100_u32 {
            history.push(
                u64::from(k) * 4_000_000 + 1,
                JointVector::splat(f64::from(k)),
            );
        }
        let at = |ns: u64| history.at(ns)[2];
        assert!((at(90 * 4_000_000 + 1_000_001) - 90.25).abs() < 1e-12);
        assert_eq!(at(u64::MAX), 99.0);
        assert_eq!(at(0), 36.0, "older ones are forgotten");
        let [low, high] = history.bounds(300_000_000, 400_000_000);
        assert_eq!((low[1], high[1]), (74.0, 99.0));
        let staircase = |ns: u64| history.in_force(ns, 2);
        assert_eq!(staircase(90 * 4_000_000 + 1), 90.0);
        assert_eq!(staircase(91 * 4_000_000), 90.0);
        assert_eq!(staircase(0), 36.0);
    }
}
