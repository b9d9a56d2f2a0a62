//! CLOCK_MONOTONIC, the clock that every stamp of the rig is taken from.

use rustix::thread::clock_nanosleep_absolute;
use rustix::time::{ClockId, Timespec, clock_gettime};
use shared_types::MonotonicNs;

const NS_PER_S: u64 = 1_000_000_000;

/// Now.
#[must_use]
pub fn now() -> MonotonicNs {
    let Timespec { tv_sec, tv_nsec } = clock_gettime(ClockId::Monotonic);
    // Both are never negative for this clock.
    let (s, ns) = (
        u64::try_from(tv_sec).unwrap_or(0),
        u64::try_from(tv_nsec).unwrap_or(0),
    );
    MonotonicNs(s * NS_PER_S + ns)
}

/// Sleeps until `deadline`; returns at once when it has passed, and early when
/// a signal interrupts the sleep.
pub fn sleep_until(deadline: MonotonicNs) {
    let request = Timespec {
        tv_sec: i64::try_from(deadline.0 / NS_PER_S).unwrap_or(i64::MAX),
        tv_nsec: i64::try_from(deadline.0 % NS_PER_S).unwrap_or(0),
    };
    // The only failure besides a signal is an invalid time, excluded above;
    // callers loop and look at the clock again in either case.
    let _ = clock_nanosleep_absolute(ClockId::Monotonic, &request);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeps_to_the_deadline_and_not_past_ones() {
        let start = now();
        sleep_until(MonotonicNs(0));
        let deadline = start.plus_s(0.01);
        while now() < deadline {
            sleep_until(deadline);
        }
        assert!(now() >= deadline);
    }
}
