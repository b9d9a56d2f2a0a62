//! What trials add up to: means, quantiles, and how well a score separates two groups.

use serde::{Deserialize, Serialize};

/// Normal quantile of 95 % limits.
const Z: f64 = 1.959_964;

/// Mean; zero for none.
#[must_use]
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values
        .into_iter()
        .fold((0.0, 0_u32), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}

/// The value below which `fraction` of them lie, by nearest rank; not a number for none.
#[must_use]
pub fn quantile(values: impl IntoIterator<Item = f64>, fraction: f64) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let at = (fraction * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(at).copied().unwrap_or(f64::NAN)
}

/// Area under the curve of hits over false alarms for scores of ropes outside and
/// inside: the probability that one outside scores higher than one inside.
#[must_use]
pub fn area_under_curve(outside: &[f64], inside: &[f64]) -> f64 {
    let wins: f64 = outside
        .iter()
        .flat_map(|o| inside.iter().map(move |i| (o, i)))
        .map(|(o, i)| match o.total_cmp(i) {
            core::cmp::Ordering::Greater => 1.0,
            core::cmp::Ordering::Equal => 0.5,
            core::cmp::Ordering::Less => 0.0,
        })
        .sum();
    wins / (outside.len() * inside.len()).max(1) as f64
}

/// A part and the limits between which the true one lies with 95 %, after Wilson.
#[must_use]
pub fn wilson(hits: usize, n: usize) -> [f64; 3] {
    if n == 0 {
        return [0.0, 0.0, 1.0];
    }
    let (n, part) = (n as f64, hits as f64 / n as f64);
    let centre = part + Z * Z / (2.0 * n);
    let spread = Z * (part * (1.0 - part) / n + Z * Z / (4.0 * n * n)).sqrt();
    let scale = 1.0 + Z * Z / n;
    let limit = |v: f64| (v / scale).clamp(0.0, 1.0);
    [part, limit(centre - spread), limit(centre + spread)]
}

/// How often something was so, with 95 % limits after Wilson.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Rate {
    /// Number of trials.
    pub n: usize,
    /// Trials in which it was so.
    #[serde(rename = "true")]
    pub hits: usize,
    /// Trials in which it was not.
    #[serde(rename = "false")]
    pub others: usize,
    /// Part of the trials in which it was so.
    pub rate: f64,
    /// Its lower limit.
    pub low: f64,
    /// Its upper limit.
    pub high: f64,
}

impl Rate {
    /// Of trials, each true or false.
    #[must_use]
    pub fn of(truths: impl IntoIterator<Item = bool>) -> Self {
        let (n, hits) = truths.into_iter().fold((0, 0), |(n, hits), truth| {
            (n + 1, hits + usize::from(truth))
        });
        let [rate, low, high] = wilson(hits, n);
        Self {
            n,
            hits,
            others: n - hits,
            rate,
            low,
            high,
        }
    }
}

impl core::fmt::Display for Rate {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let [low, high] = [self.low, self.high].map(|part| 100.0 * part);
        write!(f, "{} of {} ({low:.0} to {high:.0} %)", self.hits, self.n)
    }
}

/// How errors spread (m).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Median.
    pub median_m: f64,
    /// Smallest.
    pub min_m: f64,
    /// Greatest.
    pub max_m: f64,
    /// 99 of 100 are below.
    pub p99_m: f64,
    /// Mean.
    pub mean_m: f64,
    /// Standard deviation.
    pub std_m: f64,
}

impl Spread {
    /// Of these errors (m); not a number for none.
    #[must_use]
    pub fn of(errors_m: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = errors_m.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let count = sorted.len() as f64;
        let at = |fraction| quantile(sorted.iter().copied(), fraction);
        let mean_m = sorted.iter().sum::<f64>() / count;
        let squares: f64 = sorted.iter().map(|e| (e - mean_m).powi(2)).sum();
        Self {
            median_m: at(0.5),
            min_m: at(0.0),
            max_m: at(1.0),
            p99_m: at(0.99),
            mean_m,
            std_m: (squares / count).sqrt(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_counts_pairs() {
        assert_eq!(area_under_curve(&[2.0, 3.0], &[1.0, 2.0]), 0.875);
        assert_eq!(area_under_curve(&[1.0], &[2.0]), 0.0);
    }

    /// Newcombe, Statistics in Medicine 17 (1998), table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
    #[test]
    fn limits_of_a_part_are_those_of_the_literature() {
        for (hits, n, low, high) in [
            (81, 263, 0.2553, 0.3662),
            (15, 148, 0.0624, 0.1605),
            (0, 20, 0.0, 0.1611),
            (1, 29, 0.0061, 0.1718),
        ] {
            let [_, found_low, found_high] = wilson(hits, n);
            let within = (found_low - low).abs() < 5e-5 && (found_high - high).abs() < 5e-5;
            assert!(within, "{hits} of {n}: {found_low} to {found_high}");
        }
    }

    #[test]
    fn a_spread_is_that_of_the_numbers() {
        let s = Spread::of([3.0, 1.0, 2.0, 6.0, 3.0]);
        assert_eq!(
            (s.median_m, s.min_m, s.max_m, s.mean_m),
            (3.0, 1.0, 6.0, 3.0)
        );
        assert!((s.std_m - (14.0_f64 / 5.0).sqrt()).abs() < 1e-12);
        assert!(Spread::of([]).mean_m.is_nan());
    }
}
