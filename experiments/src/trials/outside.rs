//! How well a score tells ropes outside the parameter ranges from those inside.

/// Area under the curve of hits over false alarms for scores of ropes outside and
/// inside: the probability that one outside scores higher than one inside.
#[must_use]
#[allow(clippy::cast_precision_loss, reason = "counts are small")]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_area_counts_pairs() {
        assert_eq!(area_under_curve(&[2.0, 3.0], &[1.0, 2.0]), 0.875);
        assert_eq!(area_under_curve(&[1.0], &[2.0]), 0.0);
    }
}
