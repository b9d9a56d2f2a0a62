//! Random ropes and targets, for tables, tests and hidden trials.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// A rope drawn uniformly from the ranges of all nine parameters.
#[must_use]
pub fn random_rope(seed: u64) -> RopeParams {
    let mut rng = ChaCha12Rng::seed_from_u64(seed);
    RopeParams::from_array(RANGES.map(|r| rng.random_range(r.min..=r.max)))
}

/// A strike target that suits every rope length: 0.8 to 1.1 m from the base
/// axis, -0.2 to 0.7 m high, at most 35 degrees to either side (m).
#[must_use]
pub fn random_strike_target(seed: u64) -> [f64; 3] {
    let mut rng = ChaCha12Rng::seed_from_u64(seed ^ 0x5712_14e5);
    let rho = rng.random_range(0.8..=1.1);
    let bearing: f64 = rng.random_range(-35.0f64..=35.0).to_radians();
    [
        rho * bearing.cos(),
        rho * bearing.sin(),
        rng.random_range(-0.2..=0.7),
    ]
}

/// Keeps the ropes and films of trials apart from those of any training.
pub const TRIAL_SALT: u64 = 0x7e57_0000_0000_0000;

/// Rope `index` of the trials of `seed`.
#[must_use]
pub fn trial_rope(seed: u64, index: u64) -> RopeParams {
    random_rope(TRIAL_SALT ^ (seed << 32) ^ index)
}

/// Kinds of [`outside_rope`]: slack, hardly damped, a few long heavy links, a light lead; or of the
/// ranges but for one number far beyond them.
pub const OUTSIDE_KINDS: [&str; 5] = [
    "like a chain",
    "longer",
    "shorter",
    "stiffer",
    "heavier lead",
];

/// Which of [`OUTSIDE_KINDS`] a rope is of.
#[must_use]
pub fn outside_kind(index: u64) -> usize {
    match index % 8 {
        1 => 1,
        3 => 2,
        5 => 3,
        7 => 4,
        _ => 0,
    }
}

/// A rope no network was trained on, see [`OUTSIDE_KINDS`]: every other one is like a chain.
#[must_use]
pub fn outside_rope(seed: u64, index: u64) -> RopeParams {
    let mut rng = ChaCha12Rng::seed_from_u64(TRIAL_SALT ^ 0x000d_0000 ^ (seed << 32) ^ index);
    let mut rope = trial_rope(seed ^ 0x00d0, index);
    // A factor from 2 to 4 times beyond an end of a range.
    let mut beyond = |end: f64, up: bool| {
        let factor: f64 = rng.random_range(2.0..4.0);
        if up { end * factor } else { end / factor }
    };
    let mass = rope.mass_per_length_kg_per_m;
    match outside_kind(index) {
        0 => {
            rope.links = 12;
            rope.mass_per_length_kg_per_m = beyond(0.12, true);
            rope.joint_stiffness_nm_per_rad = beyond(0.004, false);
            rope.joint_damping_nms_per_rad = beyond(0.000_4, false);
            rope.lead_mass_kg = beyond(0.02, false);
        }
        1 => rope.length_m = 0.65 + (beyond(0.08, true) - 0.08),
        2 => rope.length_m = 0.45 - (beyond(0.05, true) - 0.05),
        // Ratios count, not values: the ends are those of the ratios to the mass.
        3 => rope.joint_stiffness_nm_per_rad = beyond(mass / 0.02, true),
        _ => rope.lead_mass_kg = beyond(6.0 * mass, true),
    }
    rope
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_lie_in_their_ranges_and_follow_the_seed() {
        for seed in 0..200 {
            assert_eq!(random_rope(seed).outside_ranges().count(), 0);
            let [x, y, z] = random_strike_target(seed);
            assert!((0.8..=1.1).contains(&x.hypot(y)) && (-0.2..=0.7).contains(&z));
        }
        assert_eq!(random_rope(3), random_rope(3));
        assert_ne!(random_rope(3), random_rope(4));
    }

    #[test]
    fn ropes_outside_can_be_simulated_and_are_outside() {
        for index in 0..64 {
            let rope = outside_rope(1, index);
            assert!(rope.validate().is_ok());
            assert!(rope.outside_ranges().count() > 0, "{index}: {rope:?}");
        }
    }
}
