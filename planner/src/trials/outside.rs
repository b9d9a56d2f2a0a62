//! Ropes from outside the parameter ranges, to see whether they are noticed.

use super::{SALT, trial_rope};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use shared_types::RopeParams;

/// A rope no network was trained on: by turns one like a chain (slack, hardly damped, a
/// few long heavy links, a light lead) and one of the ranges with its length, its
/// stiffness, its damping or its lead's mass far beyond them.
#[must_use]
pub fn outside_rope(seed: u64, index: u64) -> RopeParams {
    let mut rng = ChaCha12Rng::seed_from_u64(SALT ^ 0x000d_0000 ^ (seed << 32) ^ index);
    let mut rope = trial_rope(seed ^ 0x00d0, index);
    // A factor from 2 to 4 times beyond an end of a range.
    let mut beyond = |end: f64, up: bool| {
        let factor: f64 = rng.random_range(2.0..4.0);
        if up { end * factor } else { end / factor }
    };
    let mass = rope.mass_per_length_kg_per_m;
    match index % 8 {
        0 | 2 | 4 | 6 => {
            rope.links = 12;
            rope.mass_per_length_kg_per_m = beyond(0.12, true);
            rope.joint_stiffness_nm_per_rad = beyond(0.004, false);
            rope.joint_damping_nms_per_rad = beyond(0.000_4, false);
            rope.lead_mass_kg = beyond(0.02, false);
        }
        1 => rope.length_m = 0.65 + (beyond(0.08, true) - 0.08),
        3 => rope.length_m = 0.45 - (beyond(0.05, true) - 0.05),
        // Ratios count, not values: the ends are those of the ratios to the mass.
        5 => rope.joint_stiffness_nm_per_rad = beyond(mass / 0.02, true),
        _ => rope.lead_mass_kg = beyond(6.0 * mass, true),
    }
    rope
}

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
    fn ropes_outside_can_be_simulated_and_are_outside() {
        for index in 0..64 {
            let rope = outside_rope(1, index);
            assert!(rope.validate().is_ok());
            assert!(rope.outside_ranges().count() > 0, "{index}: {rope:?}");
        }
    }

    #[test]
    fn the_area_counts_pairs() {
        assert_eq!(area_under_curve(&[2.0, 3.0], &[1.0, 2.0]), 0.875);
        assert_eq!(area_under_curve(&[1.0], &[2.0]), 0.0);
    }
}
