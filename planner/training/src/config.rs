//! Configuration of data and training: `configs/planner/training.toml`.

use crate::error::{Result, TrainingError};
use crate::masking::MaskPhase;
use planner::OutOfRange;
use planner::features::FeatureDefinition;
use planner::observation::ObservedPoints;
use planner::synthetic::Randomisation;
use planner::wiggle::WiggleConfig;
use serde::{Deserialize, Serialize};
use shared_types::rope::RANGES;
use std::ops::RangeInclusive;
use std::path::Path;

/// Everything that decides what network comes out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TrainingConfig {
    /// Ropes and their motion.
    pub(crate) data: DataConfig,
    /// Noise of the films.
    #[serde(default)]
    pub(crate) randomisation: Randomisation,
    /// Shape of the network.
    pub(crate) network: NetworkConfig,
    /// The optimisation.
    pub(crate) training: OptimisationConfig,
}

/// Ropes and their motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DataConfig {
    /// Seed of the ropes.
    pub(crate) seed: u64,
    /// Ropes to train on.
    pub(crate) ropes: usize,
    /// Ropes that only judge.
    pub(crate) held_out: usize,
    /// Keypoints kept of each rope, and seen by the network; of link centres the most
    /// there may be.
    pub(crate) keypoints: usize,
    /// Where on the rope they lie.
    #[serde(default)]
    pub(crate) points: ObservedPoints,
    /// The motion that is filmed.
    #[serde(default)]
    pub(crate) wiggle: WiggleConfig,
}

/// Shape of the network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct NetworkConfig {
    /// Channels of the three convolution blocks.
    pub(crate) channels: [usize; 3],
    /// Length after adaptive pooling; must divide an eighth of the frames.
    pub(crate) pooled: usize,
    /// Probability with which a number is dropped after each block.
    pub(crate) dropout: f64,
}

/// The optimisation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OptimisationConfig {
    /// Seed of first weights, order, noise, masks and dropout.
    pub(crate) seed: u64,
    pub(crate) steps: usize,
    /// Films per step.
    pub(crate) batch: usize,
    /// Largest learning rate of Adam.
    pub(crate) learning_rate: f64,
    /// Steps over which the learning rate grows from 0; a cosine takes it back.
    pub(crate) warmup_steps: usize,
    /// Steps between checkpoints.
    pub(crate) checkpoint_every: usize,
    /// Steps between looks at held-out ropes.
    pub(crate) validate_every: usize,
    /// Held-out ropes looked at.
    pub(crate) validation_ropes: usize,
    /// Part of the films in which a width is not seen.
    #[serde(alias = "width_missing_part")]
    pub(crate) width_missing_fraction: f64,
    /// What is masked when, in the order of time.
    #[serde(default)]
    pub(crate) masking: Vec<MaskPhase>,
}

impl TrainingConfig {
    /// Reads and checks a configuration file.
    pub(crate) fn load(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|e| TrainingError::file(path, e))?;
        let config: Self = toml::from_str(&text).map_err(|e| TrainingError::file(path, e))?;
        config.check()?;
        Ok(config)
    }

    /// Refuses the first value that is out of range.
    pub(crate) fn check(&self) -> Result<()> {
        let wrong = |error| TrainingError::Input(format!("randomisation: {error}"));
        self.randomisation.check().map_err(wrong)?;
        let (data, network, training) = (&self.data, &self.network, &self.training);
        let count = |key, value: usize, range: RangeInclusive<usize>, expected| {
            (key, value as f64, range.contains(&value), expected)
        };
        let positive = |key, value| count(key, value, 1..=usize::MAX, "1 or more");
        let eighth = FeatureDefinition::default().frames / 8;
        let links_max = RANGES[0].max as usize;
        let rules = [
            positive("data.ropes", data.ropes),
            positive("data.held_out", data.held_out),
            count("data.keypoints", data.keypoints, 2..=32, "2 to 32"),
            (
                "data.keypoints",
                data.keypoints as f64,
                data.points == ObservedPoints::ArcLength || data.keypoints >= links_max,
                "at least the most links of the ranges, 26, for link centres",
            ),
            (
                "network.pooled",
                network.pooled as f64,
                network.pooled > 0 && eighth.is_multiple_of(network.pooled),
                "a divisor of 50, an eighth of the frames",
            ),
            (
                "network.dropout",
                network.dropout,
                (0.0..1.0).contains(&network.dropout),
                "0 to below 1",
            ),
            positive("training.steps", training.steps),
            positive("training.batch", training.batch),
            (
                "training.learning_rate",
                training.learning_rate,
                training.learning_rate > 0.0 && training.learning_rate < 1.0,
                "above 0 and below 1",
            ),
            positive("training.checkpoint_every", training.checkpoint_every),
            positive("training.validate_every", training.validate_every),
            count(
                "training.validation_ropes",
                training.validation_ropes,
                1..=data.held_out,
                "1 to data.held_out",
            ),
            (
                "training.width_missing_fraction",
                training.width_missing_fraction,
                (0.0..=1.0).contains(&training.width_missing_fraction),
                "0 to 1",
            ),
        ];
        let wrong = |what| TrainingError::Input(format!("training configuration: {what}"));
        let masking = MaskPhase::rules(&training.masking);
        OutOfRange::check(rules.into_iter().chain(masking))
            .map_err(|error| wrong(error.to_string()))?;
        let channels = network.channels;
        if !channels.iter().all(|c| (1..=1024).contains(c)) {
            let expected = "three numbers from 1 to 1024";
            return Err(wrong(format!(
                "`network.channels` is {channels:?}, but must be {expected}"
            )));
        }
        let mut phases = training.masking.iter();
        phases.find(|phase| !phase.has_few_blocks()).map_or(
            Ok(()),
            |MaskPhase { blocks, .. }| {
                let expected = "two numbers up to 100, the smaller first";
                Err(wrong(format!(
                    "`training.masking.blocks` is {blocks:?}, but must be {expected}"
                )))
            },
        )
    }

    /// What the network sees.
    pub(crate) fn features(&self) -> FeatureDefinition {
        FeatureDefinition {
            keypoints: self.data.keypoints,
            points: self.data.points,
            ..FeatureDefinition::default()
        }
    }
}

impl OptimisationConfig {
    /// Learning rate of a step: linear warm-up, then a cosine to 0.
    pub(crate) fn learning_rate_at(&self, step: usize) -> f64 {
        if step < self.warmup_steps {
            return self.learning_rate * (step + 1) as f64 / self.warmup_steps as f64;
        }
        let span = (self.steps - self.warmup_steps.min(self.steps)).max(1);
        let part = (step - self.warmup_steps) as f64 / span as f64;
        self.learning_rate * 0.5 * (1.0 + (core::f64::consts::PI * part.min(1.0)).cos())
    }
}
