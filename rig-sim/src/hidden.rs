//! The rope nobody is told about: drawn from a seed, revealed only as truth.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use shared_types::RopeParams;
use shared_types::rope::RANGES;

/// Keeps the rope's draw apart from other draws of the same seed.
const STREAM: u64 = 0x0072_6f70_6500;

/// A rope drawn uniformly from the paper's ranges ([`RANGES`]).
///
/// Damping and stiffness span more than a decade; they are drawn uniformly in
/// their logarithm, so that soft ropes are as likely as stiff ones.
#[must_use]
pub fn hidden_rope(seed: u64) -> RopeParams {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ STREAM);
    RopeParams::from_array(RANGES.map(|range| match range.key {
        "links" => f64::from(rng.random_range(20_u32..=26)),
        "joint_damping_nms_per_rad" | "joint_stiffness_nm_per_rad" => {
            rng.random_range(range.min.ln()..=range.max.ln()).exp()
        }
        _ => rng.random_range(range.min..=range.max),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rope_lies_in_the_trained_ranges_and_seeds_differ() {
        for seed in 0..200 {
            let rope = hidden_rope(seed);
            assert_eq!(rope.outside_ranges().count(), 0, "{rope:?}");
            assert!(rope.validate().is_ok());
            assert_eq!(rope, hidden_rope(seed));
            assert_ne!(rope, hidden_rope(seed + 1));
        }
    }
}
