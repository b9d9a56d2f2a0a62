//! The controller's own clock: microseconds since it was switched on, on a
//! crystal of its own.

use shared_types::MonotonicNs;

/// Maps our time to the controller's. Both its rate and its readings can be
/// wrong, as on real machines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerClock {
    /// Our time of the last change of a rate.
    since: MonotonicNs,
    /// Reading then (µs).
    reading_us: f64,
    /// Its seconds per second of ours.
    rate: f64,
    /// The same for its readings alone.
    stamp_rate: f64,
}

impl ControllerClock {
    /// A clock that reads `uptime_s` at `start` and gains `ppm` µs a second.
    #[must_use]
    pub fn new(start: MonotonicNs, uptime_s: f64, ppm: f64) -> Self {
        Self {
            since: start,
            reading_us: uptime_s * 1e6,
            rate: 1.0 + ppm * 1e-6,
            stamp_rate: 1.0,
        }
    }

    /// Its reading at `now` (µs).
    #[must_use]
    pub fn time_us(&self, now: MonotonicNs) -> u64 {
        self.reading(now).max(0.0) as u64
    }

    fn reading(&self, now: MonotonicNs) -> f64 {
        self.reading_us + now.since_s(self.since) * 1e6 * self.rate * self.stamp_rate
    }

    /// How long `span_s` of its own seconds take on our clock (s).
    #[must_use]
    pub fn span_s(&self, span_s: f64) -> f64 {
        span_s / self.rate
    }

    fn rebase(&mut self, now: MonotonicNs) {
        (self.reading_us, self.since) = (self.reading(now), now);
    }

    /// From `now` on it gains `ppm` µs a second, cycles included.
    pub fn set_rate(&mut self, now: MonotonicNs, ppm: f64) {
        self.rebase(now);
        self.rate = 1.0 + ppm * 1e-6;
    }

    /// From `now` on its readings gain `ppm` µs a second; cycles stay.
    pub fn set_stamp_rate(&mut self, now: MonotonicNs, ppm: f64) {
        self.rebase(now);
        self.stamp_rate = 1.0 + ppm * 1e-6;
    }

    /// Moves its readings by `by_s` (s).
    pub fn jump(&mut self, by_s: f64) {
        self.reading_us += by_s * 1e6;
    }

    /// Begins at zero again.
    pub fn restart(&mut self, now: MonotonicNs) {
        self.rebase(now);
        self.reading_us = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drifts_jumps_and_restarts_without_a_seam() {
        let start = MonotonicNs(5_000_000_000);
        let mut clock = ControllerClock::new(start, 100.0, 1000.0);
        assert_eq!(clock.time_us(start), 100_000_000);
        let later = start.plus_s(10.0);
        assert_eq!(clock.time_us(later), 110_010_000);
        clock.set_rate(later, 0.0);
        assert_eq!(clock.time_us(later), 110_010_000);
        assert_eq!(clock.time_us(later.plus_s(1.0)), 111_010_000);
        clock.jump(-2.0);
        assert_eq!(clock.time_us(later.plus_s(1.0)), 109_010_000);
        clock.restart(later.plus_s(1.0));
        assert_eq!(clock.time_us(later.plus_s(1.5)), 500_000);
    }
}
