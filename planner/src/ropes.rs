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
}
