//! The arm's clock on ours, from one-way delays alone.
//!
//! A report that was stamped `s` and arrived at `a` took `a - s - offset` on
//! its way; the offset is the smallest `a - s` seen, since nothing arrives
//! before it was sent. The estimate is let go slowly upwards, so that two
//! clocks that drift apart stay mapped.
//!
//! A clock that is set back shows at once by a stamp before the last one. One that
//! lags after a gap makes every report look late. A receiver that was
//! held up finds late reports, too, but all at once, and punctual ones behind
//! them.

/// Drift between the clocks that is followed (ns per s): 200 ppm.
const DRIFT_NS_PER_S: i128 = 200_000;
/// A stamp further from the map than this starts a new map at once (ns): the arm
/// was restarted, or its clock jumped. Below what the monitors take for a jump.
const JUMP_NS: i128 = 400_000_000;
/// Reports later than this (ns) ...
const LATE_NS: i128 = 20_000_000;
/// ... for at least this long, without a punctual one, start a new map as well
/// (ns).
const LATE_FOR_NS: u64 = 100_000_000;

/// How the arm's clock was read for a report, see
/// [`JointReport::arm_clock`](shared_types::ipc::JointReport::arm_clock).
pub const CLOCK_USED: u16 = 1;
/// The same with a new map, because the clock jumped.
pub const CLOCK_ANEW: u16 = 2;

/// Maps stamps of one report stream.
#[derive(Debug, Clone, Copy, Default)]
pub struct ClockMap {
    /// Offset (ns) and the arrival it was last moved at.
    offset: Option<(i128, u64)>,
    /// Arrival of the first of the late reports in a row, and the smallest
    /// offset that they show (ns).
    late: Option<(u64, i128)>,
    /// The newest stamp (µs).
    stamp_us: u64,
    /// The newest stamp began a new map.
    anew: bool,
}

impl ClockMap {
    /// When a report stamped `stamp_us` on the arm's clock was stamped on
    /// CLOCK_MONOTONIC (ns), given that it arrived at `arrival_ns`.
    pub fn to_monotonic_ns(&mut self, stamp_us: u64, arrival_ns: u64) -> u64 {
        let seen = i128::from(arrival_ns) - i128::from(stamp_us) * 1000;
        // Reports come in order, so a stamp that goes back is a clock that did.
        let back = stamp_us < core::mem::replace(&mut self.stamp_us, stamp_us);
        self.anew = false;
        let offset = match self.offset {
            Some((offset, at_ns)) => {
                let since_ns = i128::from(arrival_ns.saturating_sub(at_ns));
                let relaxed = offset + since_ns * DRIFT_NS_PER_S / 1_000_000_000;
                let jumped = back || (seen - relaxed).abs() > JUMP_NS;
                if jumped {
                    self.late = None;
                    self.anew = true;
                    seen
                } else if let Some(smallest) = self.late_for_long(seen, relaxed, arrival_ns) {
                    self.anew = true;
                    smallest
                } else {
                    seen.min(relaxed)
                }
            }
            None => seen,
        };
        self.offset = Some((offset, arrival_ns));
        u64::try_from(i128::from(stamp_us) * 1000 + offset).unwrap_or(arrival_ns)
    }

    /// [`CLOCK_USED`], or [`CLOCK_ANEW`] when the newest stamp began a new map.
    #[must_use]
    pub const fn reading(&self) -> u16 {
        if self.anew { CLOCK_ANEW } else { CLOCK_USED }
    }

    /// The offset that reports show which have been late for long.
    fn late_for_long(&mut self, seen: i128, relaxed: i128, arrival_ns: u64) -> Option<i128> {
        if seen - relaxed <= LATE_NS {
            self.late = None;
            return None;
        }
        let (since_ns, smallest) = self.late.unwrap_or((arrival_ns, seen));
        let smallest = smallest.min(seen);
        self.late = Some((since_ns, smallest));
        let long = arrival_ns.saturating_sub(since_ns) > LATE_FOR_NS;
        if long {
            self.late = None;
        }
        long.then_some(smallest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};

    /// Random delays of 0.2 to 6 ms over clocks 100 ppm apart: after a second
    /// the map is within the smallest delay plus what drift allows.
    #[test]
    fn random_delays_and_drift_are_seen_through() {
        for (seed, ppm) in [(1, -100.0), (2, 0.0), (3, 100.0)] {
            let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let mut map = ClockMap::default();
            for k in 0..25_000_u64 {
                let true_ns = 1_000_000_000_000 + k * 4_000_000;
                let stamp_us = (5e6 + (k * 4000) as f64 * (1.0 + ppm * 1e-6)) as u64;
                let arrival_ns = true_ns + rng.random_range(200_000..6_000_000_u64);
                let mapped = map.to_monotonic_ns(stamp_us, arrival_ns);
                if k > 250 {
                    let error_ns = mapped.cast_signed() - true_ns.cast_signed();
                    assert!((0..600_000).contains(&error_ns), "{k}: {error_ns}");
                }
            }
        }
    }

    #[test]
    fn a_clock_set_back_is_followed_and_a_receiver_held_up_is_not() {
        const MS: u64 = 1_000_000;
        for back_ms in [30, 300, 450, 900, 5000] {
            let mut map = ClockMap::default();
            let mut off_ns = 0;
            for k in 0..200_u64 {
                let arrival_ns = 60_000 * MS + 4 * k * MS;
                let set_back_us = if k < 50 { 0 } else { back_ms * 1000 };
                let mapped = map.to_monotonic_ns(20_000_000 + 4000 * k - set_back_us, arrival_ns);
                off_ns = arrival_ns.abs_diff(mapped);
            }
            assert!(off_ns < MS, "{back_ms} ms: off by {off_ns} ns");
        }
        // Seventy-five reports at once, 300 ms after the first of them was sent.
        let mut map = ClockMap::default();
        for k in 0..200_u64 {
            let sent_ns = 60_000 * MS + 4 * k * MS;
            let arrival_ns = if (50..125).contains(&k) {
                60_000 * MS + 4 * 125 * MS
            } else {
                sent_ns
            };
            let mapped = map.to_monotonic_ns(20_000_000 + 4000 * k, arrival_ns);
            assert!(mapped.abs_diff(sent_ns) < MS, "report {k}");
        }
    }

    #[test]
    fn a_restarted_arm_starts_a_new_map() {
        let mut map = ClockMap::default();
        assert_eq!(
            map.to_monotonic_ns(9_000_000, 50_000_000_000),
            50_000_000_000
        );
        assert_eq!(map.reading(), CLOCK_USED);
        assert_eq!(map.to_monotonic_ns(100, 51_000_000_000), 51_000_000_000);
        assert_eq!(map.reading(), CLOCK_ANEW);
        assert_eq!(map.to_monotonic_ns(4100, 51_004_000_000), 51_004_000_000);
        assert_eq!(map.reading(), CLOCK_USED);
    }

    proptest! {
        #[test]
        fn never_later_than_the_arrival(stamps in prop::collection::vec((any::<u64>(), any::<u64>()), 1..20)) {
            let mut map = ClockMap::default();
            for (stamp_us, arrival_ns) in stamps {
                prop_assert!(map.to_monotonic_ns(stamp_us, arrival_ns) <= arrival_ns);
            }
        }
    }
}
