//! From the run's clock to the one that viewers show.

use rustix::time::{ClockId, clock_gettime};

/// How far the wall clock was ahead of CLOCK_MONOTONIC when the file was begun.
/// Later steps of the wall clock do not matter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    ahead_ns: u64,
}

fn read_ns(clock: ClockId) -> u64 {
    let t = clock_gettime(clock);
    let ns = i128::from(t.tv_sec) * 1_000_000_000 + i128::from(t.tv_nsec);
    u64::try_from(ns).unwrap_or_default()
}

impl Clock {
    /// Compares both clocks.
    pub(super) fn compare() -> Self {
        let wall_ns = read_ns(ClockId::Realtime);
        Self {
            ahead_ns: wall_ns.saturating_sub(read_ns(ClockId::Monotonic)),
        }
    }

    /// Wall clock minus CLOCK_MONOTONIC (ns).
    pub(super) const fn ahead_ns(self) -> u64 {
        self.ahead_ns
    }

    /// Wall time of an instant of CLOCK_MONOTONIC (ns).
    pub(super) const fn wall_ns(self, monotonic_ns: u64) -> u64 {
        monotonic_ns.saturating_add(self.ahead_ns)
    }

    /// Wall time now (ns).
    pub(super) fn now_ns(self) -> u64 {
        self.wall_ns(read_ns(ClockId::Monotonic))
    }
}
