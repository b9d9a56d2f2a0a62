//! Random numbers as functions of a seed, a purpose and a place.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;

/// What random numbers are for; each purpose has numbers of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Purpose {
    Hypercube,
    HeldOutHypercube,
    Order,
    Noise,
    HeldOutNoise,
    Masks,
    Dropout,
    Weights,
}

/// Seed of a purpose.
pub(crate) fn seed_for(seed: u64, purpose: Purpose) -> u64 {
    // The finaliser of SplitMix64: every bit of the result depends on every bit.
    let mut z = seed
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add(purpose as u64 + 1);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Generator of a purpose at a place.
pub(crate) fn generator(seed: u64, purpose: Purpose, place: u64) -> ChaCha12Rng {
    let mut rng = ChaCha12Rng::seed_from_u64(seed_for(seed, purpose));
    rng.set_stream(place);
    rng
}

/// A random order of `0..count`.
pub(crate) fn order(rng: &mut ChaCha12Rng, count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count as u32).collect();
    for i in (1..count).rev() {
        order.swap(i, rng.random_range(0..=i));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_holds_every_number_once() {
        let mut found = order(&mut generator(3, Purpose::Order, 0), 1000);
        assert_ne!(found[..10], [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
        found.sort_unstable();
        assert!(found.into_iter().eq(0..1000));
    }

    #[test]
    fn purposes_and_places_have_numbers_of_their_own() {
        let draw = |seed, purpose, place| generator(seed, purpose, place).random::<u64>();
        let all = [
            draw(1, Purpose::Order, 0),
            draw(2, Purpose::Order, 0),
            draw(1, Purpose::Masks, 0),
            draw(1, Purpose::Order, 1),
        ];
        for i in 0..all.len() {
            assert!(all[..i].iter().all(|x| *x != all[i]));
        }
        assert_eq!(draw(1, Purpose::Order, 0), all[0]);
    }
}
