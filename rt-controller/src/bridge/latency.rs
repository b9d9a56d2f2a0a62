//! Latency histograms, filled from cycle records outside the real-time thread.

use hdrhistogram::Histogram;
use shared_types::ipc::CycleRecord;
use shared_types::ipc::message::{LatencyReport, Percentiles};

/// Largest latency resolved (ns): ten seconds.
const MAX_NS: u64 = 10_000_000_000;
/// Upper edge of the first bin shown (ns).
const FIRST_BIN_NS: u64 = 1000;

/// Histograms since they were last taken.
#[derive(Debug)]
pub struct Latencies {
    /// Of wake-up, compute, send and reply.
    histograms: [Histogram<u64>; 4],
    cycles: u64,
    missed: u64,
    longest_miss: u32,
}

impl Latencies {
    /// Empty.
    ///
    /// # Errors
    /// Never for the bounds used here; they are the library's to refuse.
    pub fn new() -> Result<Self, hdrhistogram::CreationError> {
        let empty = Histogram::new_with_bounds(1, MAX_NS, 3)?;
        Ok(Self {
            histograms: [(); 4].map(|()| empty.clone()),
            cycles: 0,
            missed: 0,
            longest_miss: 0,
        })
    }

    /// Adds one cycle.
    pub fn record(&mut self, r: &CycleRecord) {
        self.cycles += 1;
        self.missed += u64::from(r.missed);
        self.longest_miss = self.longest_miss.max(r.missed);
        let [wake, compute, send, reply] = &mut self.histograms;
        wake.saturating_record(u64::from(r.wake_late_ns));
        compute.saturating_record(u64::from(r.compute_ns));
        if r.sent != 0 {
            send.saturating_record(u64::from(r.send_ns));
        }
        if r.reply_ns != 0 {
            reply.saturating_record(u64::from(r.reply_ns));
        }
    }

    /// What was seen so far.
    #[must_use]
    pub fn report(&self) -> LatencyReport {
        let [wake, compute, send, reply] = self.histograms.each_ref().map(percentiles);
        LatencyReport {
            wake,
            compute,
            send,
            reply,
            cycles: self.cycles,
            missed: self.missed,
            longest_miss: self.longest_miss,
        }
    }

    /// Histograms of wake-up, compute, send and reply: upper edge of each bin
    /// (µs), each twice the one before, and how many fell into it.
    #[must_use]
    pub fn bins(&self) -> [Vec<(f64, u64)>; 4] {
        self.histograms.each_ref().map(|histogram| {
            // An empty histogram would give one bin of nothing.
            let bins = histogram.iter_log(FIRST_BIN_NS, 2.0);
            bins.filter(|_| !histogram.is_empty())
                .map(|bin| {
                    let edge_us = us(bin.value_iterated_to());
                    (edge_us, bin.count_since_last_iteration())
                })
                .collect()
        })
    }

    /// The report, after which everything starts from zero.
    pub(super) fn take(&mut self) -> LatencyReport {
        let report = self.report();
        self.histograms.iter_mut().for_each(Histogram::reset);
        (self.cycles, self.missed, self.longest_miss) = (0, 0, 0);
        report
    }
}

fn us(ns: u64) -> f64 {
    ns as f64 / 1e3
}

fn percentiles(histogram: &Histogram<u64>) -> Percentiles {
    Percentiles {
        count: histogram.len(),
        p50_us: us(histogram.value_at_quantile(0.5)),
        p99_us: us(histogram.value_at_quantile(0.99)),
        p999_us: us(histogram.value_at_quantile(0.999)),
        max_us: us(histogram.max()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_of_a_known_set_and_a_fresh_start() {
        let mut latencies = Latencies::new().unwrap();
        for k in 1..=1000 {
            latencies.record(&CycleRecord {
                wake_late_ns: k * 1000,
                missed: [0, 0, 3][k as usize % 3] * u32::from(k < 7),
                ..CycleRecord::default()
            });
        }
        let report = latencies.report();
        assert_eq!(
            (report.cycles, report.missed, report.longest_miss),
            (1000, 6, 3)
        );
        assert_eq!(report.reply.count, 0);
        let [wake, _, _, reply] = latencies.bins();
        assert!(reply.is_empty());
        assert_eq!(wake.iter().map(|(_, count)| count).sum::<u64>(), 1000);
        // 1 µs, then up to 2, 4, ... 1024 µs.
        assert!(
            wake.len() == 11 && (wake[3].0 / 8.0 - 1.0).abs() < 0.01,
            "{wake:?}"
        );
        assert_eq!(latencies.take(), report);
        for (found, expected) in [
            (report.wake.p50_us, 500.0),
            (report.wake.p99_us, 990.0),
            (report.wake.max_us, 1000.0),
        ] {
            assert!((found / expected - 1.0).abs() < 2e-3, "{found} {expected}");
        }
        assert_eq!(latencies.take().cycles, 0);
    }
}
