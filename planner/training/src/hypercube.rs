//! Ropes from a Latin hypercube over the parameter ranges.
//!
//! Each parameter's range is cut into as many equal parts as there are ropes, and
//! every part holds exactly one rope (paper, "Training Configuration").

use crate::draws::{Purpose, generator, order};
use rand::RngExt;
use shared_types::RopeParams;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};

/// Which ropes of a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Share {
    /// Those trained on.
    Training,
    /// Those that only judge.
    HeldOut,
}

/// A Latin hypercube of ropes.
#[derive(Debug, Clone)]
pub(crate) struct Hypercube {
    seed: u64,
    purpose: Purpose,
    /// Part of each parameter's range, rope by rope.
    parts: [Vec<u32>; ROPE_PARAMETERS],
}

impl Hypercube {
    /// The hypercube of `count` ropes.
    pub(crate) fn new(seed: u64, share: Share, count: usize) -> Self {
        let purpose = match share {
            Share::Training => Purpose::Hypercube,
            Share::HeldOut => Purpose::HeldOutHypercube,
        };
        let parts = core::array::from_fn(|parameter| {
            // Streams beyond all ropes' own.
            let stream = u64::MAX - parameter as u64;
            order(&mut generator(seed, purpose, stream), count)
        });
        Self {
            seed,
            purpose,
            parts,
        }
    }

    /// Rope `index`, below the count.
    pub(crate) fn rope(&self, index: usize) -> RopeParams {
        let mut rng = generator(self.seed, self.purpose, index as u64);
        RopeParams::from_array(core::array::from_fn(|parameter| {
            let parts = &self.parts[parameter];
            let within: f64 = rng.random();
            let u = (f64::from(parts[index]) + within) / parts.len() as f64;
            let range = RANGES[parameter];
            if range.key == "links" {
                // Whole numbers, each as likely as the others.
                (range.min + (u * (range.max - range.min + 1.0)).floor()).min(range.max)
            } else {
                range.min + u * (range.max - range.min)
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_part_of_every_range_holds_one_rope() {
        let count = 300;
        let cube = Hypercube::new(5, Share::Training, count);
        let ropes: Vec<_> = (0..count).map(|i| cube.rope(i).to_array()).collect();
        for parameter in 1..ROPE_PARAMETERS {
            let range = RANGES[parameter];
            let mut parts: Vec<usize> = ropes
                .iter()
                .map(|r| ((r[parameter] - range.min) / (range.max - range.min) * 300.0) as usize)
                .collect();
            parts.sort_unstable();
            assert!(parts.into_iter().eq(0..count), "{}", range.key);
        }
        for links in 20..=26 {
            let found = ropes.iter().filter(|r| r[0] == f64::from(links)).count();
            assert!((42..=44).contains(&found), "{links}: {found}");
        }
    }
}
