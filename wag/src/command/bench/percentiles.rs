//! Percentiles of many times.

use serde::Serialize;

/// Percentiles of a time (us), by nearest rank.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Percentiles {
    pub count: usize,
    pub p50_us: f64,
    pub p99_us: f64,
    pub p999_us: f64,
    pub max_us: f64,
}

impl Percentiles {
    /// Names of [`Self::values_us`].
    pub const NAMES: [&'static str; 4] = ["p50", "p99", "p99.9", "max"];

    /// Of samples in nanoseconds; zero without any.
    pub fn of(samples_ns: impl IntoIterator<Item = u64>) -> Self {
        let mut sorted: Vec<u64> = samples_ns.into_iter().collect();
        sorted.sort_unstable();
        let at = |per_mille: usize| {
            let rank = (sorted.len() * per_mille).div_ceil(1000).max(1);
            sorted.get(rank - 1).map_or(0.0, |ns| us(*ns))
        };
        Self {
            count: sorted.len(),
            p50_us: at(500),
            p99_us: at(990),
            p999_us: at(999),
            max_us: at(1000),
        }
    }

    /// What is reported of them.
    pub const fn values_us(&self) -> [f64; 4] {
        [self.p50_us, self.p99_us, self.p999_us, self.max_us]
    }
}

#[allow(clippy::cast_precision_loss, reason = "far below 2^53 ns")]
fn us(ns: u64) -> f64 {
    ns as f64 * 1e-3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_samples_by_nearest_rank() {
        let found = Percentiles::of((1..=1000).map(|k| k * 1000));
        let want = [500.0, 990.0, 999.0, 1000.0];
        let mut pairs = found.values_us().into_iter().zip(want);
        assert!(pairs.all(|(g, w)| (g - w).abs() < 1e-9), "{found:?}");
        assert_eq!(Percentiles::of([]).count, 0);
    }
}
