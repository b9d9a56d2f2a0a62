//! Curriculum masking: blocks of frames hidden from the network, more of them as
//! the training goes on (paper, "Curriculum Masking Schedule").

use planner::Rule;
use planner::features::WiggleFeatures;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

/// Masking during a part of the training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct MaskPhase {
    /// Part of all steps after which it begins (0 to 1).
    pub(crate) from: f64,
    /// Fewest and most blocks hidden in a film.
    pub(crate) blocks: [usize; 2],
    /// Frames of a block.
    pub(crate) block_frames: usize,
    /// Whether blocks near the start are preferred.
    pub(crate) at_the_beginning: bool,
}

impl MaskPhase {
    /// What must hold of the phases of a training, beside their numbers of blocks.
    pub(crate) fn rules(phases: &[Self]) -> impl Iterator<Item = Rule> {
        const FROM: &str = "0 to 1, and at least that of the phase before";
        let before = core::iter::once(0.0).chain(phases.iter().map(|p| p.from));
        phases.iter().zip(before).map(|(phase, before)| {
            let in_order = (before..=1.0).contains(&phase.from);
            ("training.masking.from", phase.from, in_order, FROM)
        })
    }

    /// Whether its numbers of blocks are in order and not absurd.
    pub(crate) fn has_few_blocks(&self) -> bool {
        let [fewest, most] = self.blocks;
        fewest <= most && most <= 100
    }

    /// The phase at a part of the training, if one has begun.
    pub(crate) fn at(phases: &[Self], part: f64) -> Option<&Self> {
        phases.iter().take_while(|p| p.from <= part).last()
    }

    /// Hides blocks of a film.
    pub(crate) fn apply(&self, features: &mut WiggleFeatures, rng: &mut ChaCha12Rng) {
        let frames = features.definition.frames;
        let places = frames.saturating_sub(self.block_frames);
        for _ in 0..rng.random_range(self.blocks[0]..=self.blocks[1]) {
            let mut along: f64 = rng.random();
            if self.at_the_beginning {
                // Half of the blocks begin in the first quarter.
                along *= along;
            }
            let start = (along * (places + 1) as f64) as usize;
            features.mask(start..start + self.block_frames);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::{Purpose, generator};
    use planner::features::FeatureDefinition;

    fn phase(from: f64, blocks: usize, at_the_beginning: bool) -> MaskPhase {
        MaskPhase {
            from,
            blocks: [blocks, blocks],
            block_frames: 50,
            at_the_beginning,
        }
    }

    #[test]
    fn phases_follow_each_other() {
        let phases = [phase(0.1, 1, false), phase(0.4, 2, true)];
        assert!(MaskPhase::at(&phases, 0.05).is_none());
        assert_eq!(MaskPhase::at(&phases, 0.2), Some(&phases[0]));
        assert_eq!(MaskPhase::at(&phases, 0.9), Some(&phases[1]));
        let holds = |phases: &[MaskPhase]| MaskPhase::rules(phases).all(|rule| rule.2);
        assert!(holds(&phases));
        let [a, b] = phases;
        assert!(!holds(&[b, a.clone()]));
        assert!(!holds(&[phase(1.5, 1, false)]));
        assert!(a.has_few_blocks() && !phase(0.0, 101, false).has_few_blocks());
    }

    #[test]
    fn blocks_hide_whole_frames_and_prefer_the_beginning_when_asked() {
        let definition = FeatureDefinition::default();
        let starts_early = |biased, place| {
            let mut film = WiggleFeatures {
                definition,
                motion: vec![1.0; definition.frames * definition.channels()],
                widths: [0.0; 4],
                seen: definition.frames,
            };
            let mut rng = generator(1, Purpose::Masks, place);
            phase(0.0, 1, biased).apply(&mut film, &mut rng);
            assert_eq!(film.seen, 350);
            let start = film.motion.iter().position(|x| *x == 0.0).unwrap() / 48;
            start < 88
        };
        let early = |biased| {
            (0..300)
                .filter(|place| starts_early(biased, *place))
                .count()
        };
        let (anywhere, biased) = (early(false), early(true));
        assert!((50..100).contains(&anywhere), "{anywhere}");
        assert!((125..175).contains(&biased), "{biased}");
    }
}
