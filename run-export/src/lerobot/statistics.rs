//! What is said of a feature's values in `meta/stats.json`: learners scale by it.

/// Names of the statistics in the files, in the order of [`Distribution::statistics`].
pub(super) const NAMES: [&str; 9] = [
    "min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99",
];
/// Parts of the values that lie below each quantile.
const QUANTILES: [f64; 5] = [0.01, 0.10, 0.50, 0.90, 0.99];

/// Values, and how often each occurs.
#[derive(Debug, Clone, Default)]
pub(super) struct Distribution(Vec<(f64, u64)>);

impl Distribution {
    /// Of numbers, each once; NaN stands for a missing one and is left out.
    pub(super) fn of(values: impl Iterator<Item = f64>) -> Self {
        let known = values.filter(|value| !value.is_nan());
        Self(known.map(|value| (value, 1)).collect())
    }

    /// Of the levels of a colour channel, 0 to 255 as 0 to 1.
    pub(super) fn of_levels(counts: &[u64; 256]) -> Self {
        let levels = (0..=u8::MAX).map(|level| f64::from(level) / 255.0);
        let counted = levels.zip(counts.iter().copied());
        Self(counted.filter(|(_, count)| *count > 0).collect())
    }

    /// Takes in more values.
    pub(super) fn add(&mut self, more: &Self) {
        self.0.extend_from_slice(&more.0);
    }

    /// Least, greatest, mean, standard deviation of the population, and quantiles, linearly
    /// interpolated between values; `None` of no values.
    pub(super) fn statistics(&self) -> Option<[f64; NAMES.len()]> {
        let mut rising = self.0.clone();
        rising.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (least, greatest) = (rising.first()?.0, rising.last()?.0);
        // How many there are up to each.
        let mut count = 0;
        let up_to: Vec<u64> = rising
            .iter()
            .map(|(_, times)| {
                count += times;
                count
            })
            .collect();
        let sum = |term: &dyn Fn(f64) -> f64| -> f64 {
            rising
                .iter()
                .map(|(v, times)| *times as f64 * term(*v))
                .sum()
        };
        let mean = sum(&|value| value) / count as f64;
        let variance = sum(&|value| (value - mean).powi(2)) / count as f64;
        let at = |rank: u64| rising[up_to.partition_point(|n| *n <= rank)].0;
        let [q01, q10, q50, q90, q99] = QUANTILES.map(|part| {
            let place = part * (count - 1) as f64;
            let (below, above) = (at(place.floor() as u64), at(place.ceil() as u64));
            below + place.fract() * (above - below)
        });
        let std = variance.sqrt();
        Some([least, greatest, mean, std, q01, q10, q50, q90, q99])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Formulas of the first hundred numbers and one; the mean's and the variance's are known.
    #[test]
    fn statistics_of_a_row_of_numbers_are_those_of_the_formulas() {
        let numbers = (0..=100).rev().map(f64::from);
        let found = Distribution::of(numbers.chain([f64::NAN])).statistics();
        let std = ((101.0_f64.powi(2) - 1.0) / 12.0).sqrt();
        let expected = [0.0, 100.0, 50.0, std, 1.0, 10.0, 50.0, 90.0, 99.0];
        for ((name, found), expected) in NAMES.iter().zip(found.unwrap()).zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{name}: {found}");
        }
        assert!(
            Distribution::of([f64::NAN].into_iter())
                .statistics()
                .is_none()
        );
    }

    #[test]
    fn quantiles_between_two_values_are_interpolated() {
        let found = Distribution::of([4.0, 2.0].into_iter())
            .statistics()
            .unwrap();
        for (place, expected) in [(4, 2.02), (5, 2.2), (6, 3.0), (7, 3.8), (8, 3.98)] {
            assert!((found[place] - expected).abs() < 1e-12, "{found:?}");
        }
    }

    /// A quarter of the pixels are white, of another picture as large all are black.
    #[test]
    fn levels_count_as_often_as_they_occur_in_all_pictures() {
        let mut counts = [0; 256];
        (counts[0], counts[255]) = (750, 250);
        let mut all = Distribution::of_levels(&counts);
        (counts[0], counts[255]) = (1000, 0);
        all.add(&Distribution::of_levels(&counts));
        let [least, greatest, mean, std, q01, .., q50, q90, q99] = all.statistics().unwrap();
        assert_eq!([least, greatest, mean], [0.0, 1.0, 0.125]);
        assert!((std - (0.125_f64 * 0.875).sqrt()).abs() < 1e-12, "{std}");
        assert_eq!([q01, q50, q90, q99], [0.0, 0.0, 1.0, 1.0]);
    }
}
