//! How punctual the control loop was in the last seconds.

use crate::report::{Histogram, histogram};
use shared_types::ipc::CycleRecord;
use std::collections::VecDeque;

/// Cycles looked back on: ten seconds.
const CYCLES: usize = 2500;

/// Times of the last cycles (µs).
#[derive(Debug, Default)]
pub(crate) struct Jitter {
    cycles: VecDeque<[f64; 2]>,
    /// Cycles missed since somebody watches.
    pub missed: u64,
}

impl Jitter {
    pub(crate) fn add(&mut self, cycle: &CycleRecord) {
        if self.cycles.len() == CYCLES {
            self.cycles.pop_front();
        }
        let us = |ns: u32| f64::from(ns) / 1e3;
        self.cycles
            .push_back([us(cycle.wake_late_ns), us(cycle.compute_ns)]);
        self.missed += u64::from(cycle.missed);
    }

    /// Histograms of the last ten seconds; none before the first cycle.
    pub(crate) fn histograms(&self) -> Vec<Histogram> {
        ["wake-up latency", "compute"]
            .into_iter()
            .enumerate()
            .filter_map(|(i, name)| histogram(name, self.cycles.iter().map(|c| c[i]).collect()))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_last_ten_seconds_count() {
        let mut jitter = Jitter::default();
        assert!(jitter.histograms().is_empty());
        for cycle in 0..3000_u32 {
            jitter.add(&CycleRecord {
                wake_late_ns: if cycle < 500 { 1_000_000 } else { 5_000 },
                compute_ns: 9_000,
                missed: u32::from(cycle == 3),
                ..CycleRecord::default()
            });
        }
        let found = jitter.histograms();
        assert_eq!((found[0].cycles, found[0].max_us), (CYCLES, 5.0));
        assert_eq!((found[1].p50_us, jitter.missed), (9.0, 1));
    }
}
