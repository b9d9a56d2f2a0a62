//! Means and middles of numbers.

/// 0 for none.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The number below which the part `q` lies; 0 for none.
pub(super) fn quantile(values: impl Iterator<Item = f64>, q: f64) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let at = values.len().saturating_sub(1) as f64 * q;
    ranked(&mut values, at as usize)
}

/// The middle one, the greater of two; 0 for none.
pub(in super::super) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    let middle = values.len() / 2;
    ranked(&mut values, middle)
}

fn ranked(values: &mut [f64], at: usize) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}
