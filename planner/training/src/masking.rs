//! Curriculum masking: blocks of frames hidden from the network, more of them as
//! the training goes on (paper, "Curriculum Masking Schedule").

use crate::TrainingError;
use planner::features::WiggleFeatures;
use rand::RngExt;
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};

/// Masking during a part of the training.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaskPhase {
    /// Part of all steps after which it begins (0 to 1).
    pub from: f64,
    /// Fewest and most blocks hidden in a film.
    pub blocks: [usize; 2],
    /// Frames of a block.
    pub block_frames: usize,
    /// Whether blocks near the start are preferred.
    pub at_the_beginning: bool,
}

impl MaskPhase {
    pub(crate) fn check_all(phases: &[Self]) -> Result<(), TrainingError> {
        let bad = |value: String, expected| {
            Err(TrainingError::Value {
                key: "training.masking",
                value,
                expected,
            })
        };
        for phase in phases {
            if !(0.0..=1.0).contains(&phase.from) {
                return bad(format!("from = {}", phase.from), "0 to 1 in `from`");
            }
            if phase.blocks[0] > phase.blocks[1] || phase.blocks[1] > 100 {
                let found = format!("blocks = {:?}", phase.blocks);
                return bad(found, "`blocks` up to 100, the smaller first");
            }
        }
        if phases.windows(2).any(|pair| pair[0].from > pair[1].from) {
            return bad("out of order".to_owned(), "in the order of `from`");
        }
        Ok(())
    }

    /// The phase at a part of the training, if one has begun.
    #[must_use]
    pub fn at(phases: &[Self], part: f64) -> Option<&Self> {
        phases.iter().take_while(|p| p.from <= part).last()
    }

    /// Hides blocks of a film.
    pub(crate) fn apply(&self, features: &mut WiggleFeatures, rng: &mut ChaCha12Rng) {
        let frames = features.definition.frames;
        let places = frames.saturating_sub(self.block_frames);
        let blocks = rng.random_range(self.blocks[0]..=self.blocks[1]);
        for _ in 0..blocks {
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

    fn film() -> WiggleFeatures {
        let definition = FeatureDefinition::default();
        WiggleFeatures {
            definition,
            motion: vec![1.0; definition.frames * definition.channels()],
            widths: [0.0; 4],
            seen: definition.frames,
        }
    }

    #[test]
    fn phases_follow_each_other() {
        let phases = [phase(0.1, 1, false), phase(0.4, 2, true)];
        assert!(MaskPhase::at(&phases, 0.05).is_none());
        assert_eq!(MaskPhase::at(&phases, 0.2), Some(&phases[0]));
        assert_eq!(MaskPhase::at(&phases, 0.9), Some(&phases[1]));
        assert!(MaskPhase::check_all(&phases).is_ok());
        let [a, b] = phases;
        assert!(MaskPhase::check_all(&[b, a]).is_err());
    }

    #[test]
    fn blocks_hide_whole_frames_and_prefer_the_beginning_when_asked() {
        let (mut early, mut early_biased) = (0, 0);
        for place in 0..300 {
            let mut rng = generator(1, Purpose::Masks, place);
            let mut one = film();
            phase(0.0, 1, false).apply(&mut one, &mut rng);
            assert_eq!(one.seen, 350);
            let mut biased = film();
            phase(0.0, 1, true).apply(&mut biased, &mut rng);
            assert_eq!(biased.seen, 350);
            let start = |f: &WiggleFeatures| f.motion.iter().position(|x| *x == 0.0).unwrap() / 48;
            early += usize::from(start(&one) < 88);
            early_biased += usize::from(start(&biased) < 88);
        }
        assert!((50..100).contains(&early), "{early}");
        assert!((125..175).contains(&early_biased), "{early_biased}");
    }
}
