//! Times of the control loop as histograms.

use super::data::Histogram;
use shared_types::ipc::CycleRecord;

/// Bins for each doubling.
const BINS_PER_OCTAVE: f64 = 2.0;
/// End of the first bin (µs).
const FIRST_US: f64 = 4.0;
/// Bins with an upper end; the last one ends at 4 µs · 2^13 = 33 ms.
const BINS: u32 = 27;

/// Histograms of wake-up, computing and sending over the cycles that belong to a
/// motion; empty when there was none.
pub(crate) fn histograms(cycles: &[&CycleRecord]) -> Vec<Histogram> {
    let us = |of: fn(&CycleRecord) -> u32, sent_only: bool| {
        let counted = cycles.iter().filter(|c| !sent_only || c.sent != 0);
        counted.map(|c| f64::from(of(c)) / 1e3).collect()
    };
    [
        ("wake-up latency", us(|c| c.wake_late_ns, false)),
        ("compute", us(|c| c.compute_ns, false)),
        ("wake-up to sent", us(|c| c.send_ns, true)),
    ]
    .into_iter()
    .filter_map(|(name, times): (_, Vec<f64>)| histogram(name, times))
    .collect()
}

/// One histogram; none of no times.
pub fn histogram(name: &'static str, mut times_us: Vec<f64>) -> Option<Histogram> {
    times_us.sort_by(f64::total_cmp);
    let max_us = *times_us.last()?;
    let upto_us: Vec<f64> = (0..BINS)
        .map(|bin| FIRST_US * 2f64.powf(f64::from(bin) / BINS_PER_OCTAVE))
        .collect();
    let mut counts = vec![0; upto_us.len() + 1];
    for time_us in &times_us {
        counts[upto_us.partition_point(|end| end < time_us)] += 1;
    }
    // The smallest time that so many of a hundred do not exceed.
    let percentile = |hundredths: usize| {
        let rank = (times_us.len() * hundredths).div_ceil(100);
        times_us[rank.saturating_sub(1)]
    };
    Some(Histogram {
        name,
        counts,
        cycles: times_us.len(),
        p50_us: percentile(50),
        p99_us: percentile(99),
        max_us,
        upto_us: upto_us
            .iter()
            .map(|end| (end * 10.0).round() / 10.0)
            .collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cycle_is_in_one_bin_and_percentiles_are_times_that_occurred() {
        let times: Vec<f64> = (1..=200).map(f64::from).chain([1e6]).collect();
        let found = histogram("x", times).unwrap();
        assert_eq!(found.counts.iter().sum::<usize>(), 201);
        assert_eq!(found.counts[0], 4, "1 to 4 µs");
        assert_eq!(*found.counts.last().unwrap(), 1, "beyond the last end");
        assert_eq!((found.p50_us, found.p99_us), (101.0, 199.0));
        assert_eq!(found.max_us, 1e6);
        assert!(histogram("x", Vec::new()).is_none());
    }
}
