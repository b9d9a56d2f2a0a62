//! Configuration of data and training: `configs/planner/training.toml`.

use crate::TrainingError;
use crate::masking::MaskPhase;
use planner::features::FeatureDefinition;
use planner::observation::ObservedPoints;
use planner::synthetic::Randomisation;
use planner::wiggle::WiggleConfig;
use serde::{Deserialize, Serialize};
use shared_types::rope::RANGES;
use std::path::Path;

/// Everything that decides what network comes out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainingConfig {
    /// Ropes and their motion.
    pub data: DataConfig,
    /// Noise of the films.
    #[serde(default)]
    pub randomisation: Randomisation,
    /// Shape of the network.
    pub network: NetworkConfig,
    /// The optimisation.
    pub training: OptimisationConfig,
}

/// Ropes and their motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DataConfig {
    /// Seed of the ropes.
    pub seed: u64,
    /// Ropes to train on.
    pub ropes: usize,
    /// Ropes that only judge.
    pub held_out: usize,
    /// Keypoints kept of each rope, and seen by the network; of link centres the most
    /// there may be.
    pub keypoints: usize,
    /// Where on the rope they lie.
    #[serde(default)]
    pub points: ObservedPoints,
    /// The motion that is filmed.
    #[serde(default)]
    pub wiggle: WiggleConfig,
}

/// Shape of the network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NetworkConfig {
    /// Channels of the three convolution blocks.
    pub channels: [usize; 3],
    /// Length after adaptive pooling; must divide an eighth of the frames.
    pub pooled: usize,
    /// Probability with which a number is dropped after each block.
    pub dropout: f64,
}

/// The optimisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OptimisationConfig {
    /// Seed of first weights, order, noise, masks and dropout.
    pub seed: u64,
    /// Steps.
    pub steps: usize,
    /// Films per step.
    pub batch: usize,
    /// Largest learning rate of Adam.
    pub learning_rate: f64,
    /// Steps over which the learning rate grows from 0; a cosine takes it back.
    pub warmup_steps: usize,
    /// Steps between checkpoints.
    pub checkpoint_every: usize,
    /// Steps between looks at held-out ropes.
    pub validate_every: usize,
    /// Held-out ropes looked at.
    pub validation_ropes: usize,
    /// Part of the films in which a width is not seen.
    pub width_missing_part: f64,
    /// What is masked when, in the order of time.
    #[serde(default)]
    pub masking: Vec<MaskPhase>,
}

impl TrainingConfig {
    /// Reads and checks a configuration file.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn load(path: &Path) -> Result<Self, TrainingError> {
        let text =
            std::fs::read_to_string(path).map_err(|source| TrainingError::file(path, source))?;
        let config: Self = toml::from_str(&text)
            .map_err(|error| TrainingError::bad_file(path, error.to_string()))?;
        config.check()?;
        Ok(config)
    }

    /// Checks every value.
    ///
    /// # Errors
    /// The first that is out of range.
    pub fn check(&self) -> Result<(), TrainingError> {
        self.randomisation.check()?;
        let (data, network, training) = (&self.data, &self.network, &self.training);
        let frames = FeatureDefinition::default().frames;
        let whole = network.pooled > 0 && (frames / 8).is_multiple_of(network.pooled);
        let count = |key, value: usize, min: usize, expected| {
            (key, value.to_string(), value >= min, expected)
        };
        let rules = [
            count("data.ropes", data.ropes, 1, "1 or more"),
            count("data.held_out", data.held_out, 1, "1 or more"),
            (
                "data.keypoints",
                data.keypoints.to_string(),
                (2..=32).contains(&data.keypoints),
                "2 to 32",
            ),
            (
                "data.keypoints",
                data.keypoints.to_string(),
                data.points == ObservedPoints::ArcLength || data.keypoints >= most_links(),
                "at least the most links of the ranges, 26, for link centres",
            ),
            (
                "network.channels",
                format!("{:?}", network.channels),
                network.channels.iter().all(|c| (1..=1024).contains(c)),
                "three numbers from 1 to 1024",
            ),
            (
                "network.pooled",
                network.pooled.to_string(),
                whole,
                "a divisor of 50, an eighth of the frames",
            ),
            (
                "network.dropout",
                network.dropout.to_string(),
                (0.0..1.0).contains(&network.dropout),
                "0 to below 1",
            ),
            count("training.steps", training.steps, 1, "1 or more"),
            count("training.batch", training.batch, 1, "1 or more"),
            (
                "training.learning_rate",
                training.learning_rate.to_string(),
                training.learning_rate > 0.0 && training.learning_rate < 1.0,
                "above 0 and below 1",
            ),
            count(
                "training.checkpoint_every",
                training.checkpoint_every,
                1,
                "1 or more",
            ),
            count(
                "training.validate_every",
                training.validate_every,
                1,
                "1 or more",
            ),
            (
                "training.validation_ropes",
                training.validation_ropes.to_string(),
                (1..=data.held_out).contains(&training.validation_ropes),
                "1 to data.held_out",
            ),
            (
                "training.width_missing_part",
                training.width_missing_part.to_string(),
                (0.0..=1.0).contains(&training.width_missing_part),
                "0 to 1",
            ),
        ];
        for (key, value, holds, expected) in rules {
            if !holds {
                return Err(TrainingError::Value {
                    key,
                    value,
                    expected,
                });
            }
        }
        MaskPhase::check_all(&training.masking)
    }

    /// What the network sees.
    #[must_use]
    pub fn features(&self) -> FeatureDefinition {
        FeatureDefinition {
            keypoints: self.data.keypoints,
            points: self.data.points,
            ..FeatureDefinition::default()
        }
    }
}

/// Most links of the ranges.
fn most_links() -> usize {
    RANGES[0].max as usize
}

impl OptimisationConfig {
    /// Learning rate of a step: linear warm-up, then a cosine to 0.
    #[must_use]
    pub fn learning_rate_at(&self, step: usize) -> f64 {
        if step < self.warmup_steps {
            return self.learning_rate * (step + 1) as f64 / self.warmup_steps as f64;
        }
        let span = (self.steps - self.warmup_steps.min(self.steps)).max(1);
        let part = (step - self.warmup_steps) as f64 / span as f64;
        self.learning_rate * 0.5 * (1.0 + (core::f64::consts::PI * part.min(1.0)).cos())
    }
}
