//! Instants on one clock: CLOCK_MONOTONIC, in integer nanoseconds.
//!
//! Nothing here reads a clock; the caller passes the time in, so that the same
//! code runs in virtual time and in replay.

use serde::{Deserialize, Serialize};

/// Nanoseconds per second.
pub const NS_PER_S: f64 = 1e9;

/// An instant of CLOCK_MONOTONIC in nanoseconds. RT-safe.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize, Deserialize,
)]
#[repr(transparent)]
#[serde(transparent)]
pub struct MonotonicNs(pub u64);

impl MonotonicNs {
    /// Seconds from `earlier` to `self`; negative when `self` is the earlier one.
    #[must_use]
    pub fn since_s(self, earlier: Self) -> f64 {
        if self.0 >= earlier.0 {
            (self.0 - earlier.0) as f64 / NS_PER_S
        } else {
            -((earlier.0 - self.0) as f64) / NS_PER_S
        }
    }

    /// This instant plus `span_s` seconds, saturating at the ends of the clock.
    #[must_use]
    pub fn plus_s(self, span_s: f64) -> Self {
        if span_s >= 0.0 {
            Self(self.0.saturating_add((span_s * NS_PER_S) as u64))
        } else {
            Self(self.0.saturating_sub((-span_s * NS_PER_S) as u64))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_signed_and_exact_to_a_nanosecond() {
        let a = MonotonicNs(5_000_000_000);
        assert_eq!(a.plus_s(1.5).0, 6_500_000_000);
        assert_eq!(a.plus_s(-1.5).0, 3_500_000_000);
        assert_eq!(MonotonicNs(7_000_000_001).since_s(a), 2.000_000_001);
        assert_eq!(a.since_s(MonotonicNs(7_000_000_000)), -2.0);
        assert_eq!(a.plus_s(-1e30).0, 0);
    }
}
