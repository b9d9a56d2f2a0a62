//! From the run's clock to the one that viewers show, and at which rate.

use rt_controller::os::now_ns;
use std::time::{SystemTime, UNIX_EPOCH};

/// How far the wall clock was ahead of CLOCK_MONOTONIC when the file was begun.
/// Later steps of the wall clock do not matter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clock {
    /// Wall clock minus CLOCK_MONOTONIC (ns).
    pub(super) ahead_ns: u64,
}

impl Clock {
    /// Compares both clocks.
    pub(super) fn compare() -> Self {
        let wall = SystemTime::now().duration_since(UNIX_EPOCH);
        let wall_ns = u64::try_from(wall.unwrap_or_default().as_nanos()).unwrap_or_default();
        Self {
            ahead_ns: wall_ns.saturating_sub(now_ns()),
        }
    }

    /// Wall time of an instant of CLOCK_MONOTONIC (ns).
    pub(super) const fn wall_ns(self, monotonic_ns: u64) -> u64 {
        monotonic_ns.saturating_add(self.ahead_ns)
    }

    /// Wall time now (ns).
    pub(super) fn now_ns(self) -> u64 {
        self.wall_ns(now_ns())
    }
}

/// Lets one through per period of its own time.
#[derive(Debug)]
pub(super) struct Thinned {
    period_ns: u64,
    next_ns: u64,
}

impl Thinned {
    /// So many a second.
    pub(super) fn at(rate_hz: f64) -> Self {
        Self {
            period_ns: (1e9 / rate_hz) as u64,
            next_ns: 0,
        }
    }

    /// Whether the one of this instant goes through.
    pub(super) fn takes(&mut self, stamp_ns: u64) -> bool {
        if stamp_ns < self.next_ns {
            return false;
        }
        // Keeps the rhythm, and finds it again after a pause.
        let slack_ns = self.period_ns / 4;
        let due_ns = self.next_ns + self.period_ns;
        self.next_ns = due_ns.max((stamp_ns + self.period_ns).saturating_sub(slack_ns));
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_of_the_frames_of_a_jittering_camera_are_taken() {
        let mut thinned = Thinned::at(30.0);
        let taken = (0..600u64)
            .map(|n| 5_000_000_000 + n * 16_666_667 + (n * 7_919 % 3_000_000))
            .filter(|stamp| thinned.takes(*stamp))
            .count();
        assert!((295..=305).contains(&taken), "{taken}");
        assert!(thinned.takes(60_000_000_000));
        assert!(!thinned.takes(60_010_000_000));
    }
}
