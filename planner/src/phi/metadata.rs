//! What a model file says about itself, and whether to believe it.

use super::file::{NotFields, parts, weights};
use crate::features::FeatureDefinition;
use crate::synthetic::Randomisation;
use crate::wiggle::WiggleConfig;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use shared_types::rope::{ParameterRange, RANGES, ROPE_PARAMETERS};
use std::collections::BTreeMap;

/// Key of the metadata in the model file; the value is JSON.
pub const METADATA_KEY: &str = "phi-nn";
/// Version of the metadata and of the network's inputs and outputs.
pub const FORMAT: u32 = 1;

/// One of the network's outputs: 0 is `min`, 1 is `max`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterScale {
    /// Key in `rope.toml`.
    pub key: String,
    /// Value at output 0.
    pub min: f64,
    /// Value at output 1.
    pub max: f64,
}

/// How the network came to be.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrainingRecord {
    /// Seed of ropes, noise and first weights.
    pub seed: u64,
    /// Ropes trained on.
    pub ropes: usize,
    /// Hash of their simulated motions (SHA-256, hexadecimal).
    pub data_sha256: String,
    /// Optimisation steps.
    pub steps: usize,
    /// Films per step.
    pub batch: usize,
    /// Noise they were filmed with.
    pub randomisation: Randomisation,
}

/// What the trained network gave for [`probe`](super::probe).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeOutputs {
    /// Normalised parameters.
    pub mean: Vec<f32>,
    /// Logarithms of their variances.
    pub log_variance: Vec<f32>,
}

/// Metadata of a model file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhiMetadata {
    /// Version: [`FORMAT`].
    pub format: u32,
    /// Meaning of the input.
    pub features: FeatureDefinition,
    /// The motion that was filmed.
    pub wiggle: WiggleConfig,
    /// Meaning of the outputs, in their order.
    pub parameters: Vec<ParameterScale>,
    /// Out-of-distribution score that one in a hundred ropes of the ranges exceeds.
    #[serde(rename = "oddity_limit")]
    pub out_of_distribution_limit: f64,
    /// Outputs that the weights must give again.
    pub probe: ProbeOutputs,
    /// How it was trained.
    pub training: TrainingRecord,
    /// Hash of the graph with all weights (SHA-256, hexadecimal).
    pub graph_sha256: String,
}

/// Why a file is not used as a model: it cannot be read, is no model of this program or not
/// for this version of it, or is damaged; and what to do.
#[derive(Debug, thiserror::Error)]
#[error("model {0}")]
pub struct ModelError(String);

impl ModelError {
    /// Of the file `name`, or `embedded`.
    pub(super) fn new(name: &str, reason: impl core::fmt::Display) -> Self {
        Self(format!("{name}: {reason}"))
    }
}

/// Hash of a graph as it stands in a model file, with all its weights.
#[must_use]
pub fn graph_sha256(graph: &[u8]) -> String {
    hex(Sha256::digest(graph).as_slice())
}

/// Lower-case hexadecimal digits.
#[must_use]
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

impl PhiMetadata {
    /// Reads and checks the metadata of a model file's bytes, and reads its weights by
    /// name; in words what is wrong with them.
    pub(super) fn read(bytes: &[u8]) -> Result<(Self, BTreeMap<&str, Vec<f32>>), String> {
        let not_onnx = |reason: &str| format!("not an ONNX file: {reason}");
        let found = parts(bytes).map_err(|NotFields| not_onnx("cut short, or something else"))?;
        let graph = found.graph.ok_or_else(|| not_onnx("it has no graph"))?;
        let mut entries = found.metadata.into_iter();
        let (_, text) = entries.find(|(key, _)| *key == METADATA_KEY).ok_or_else(|| {
            format!("has no `{METADATA_KEY}` metadata, so it was not written by phi-train: export it again")
        })?;
        let metadata: Self = serde_json::from_str(text)
            .map_err(|error| format!("metadata not understood: {error}"))?;
        metadata.check()?;
        if graph_sha256(graph) != metadata.graph_sha256 {
            let damaged = "damaged, its weights do not have the hash they were written with";
            return Err(damaged.to_owned());
        }
        let weights = weights(graph).map_err(|NotFields| not_onnx("its weights are cut short"))?;
        Ok((metadata, weights))
    }

    fn check(&self) -> Result<(), String> {
        if self.format != FORMAT {
            return Err(format!(
                "format {}, this program reads {FORMAT}: export it again",
                self.format
            ));
        }
        if self.features.version != FeatureDefinition::VERSION {
            return Err(format!(
                "trained on features of version {}, this program makes {}: train it again",
                self.features.version,
                FeatureDefinition::VERSION
            ));
        }
        let fits = self.parameters.len() == ROPE_PARAMETERS
            && self
                .parameters
                .iter()
                .zip(RANGES)
                .all(|(p, range)| p.key == range.key && p.min < p.max);
        if !fits {
            let found: Vec<&str> = self.parameters.iter().map(|p| p.key.as_str()).collect();
            return Err(format!(
                "its outputs are {}, not the nine rope parameters in their order",
                found.join(", ")
            ));
        }
        Ok(())
    }
}

impl ParameterScale {
    /// Outputs as fractions of the parameter ranges.
    #[must_use]
    pub fn of_ranges() -> Vec<Self> {
        let scale = |range: &ParameterRange| Self {
            key: range.key.to_owned(),
            min: range.min,
            max: range.max,
        };
        RANGES.iter().map(scale).collect()
    }
}

/// Physical values of nine normalised outputs, and their standard deviations, order of
/// [`RANGES`].
///
/// # Panics
/// With fewer than nine numbers or scales, as indexing does.
#[must_use]
pub fn in_units(
    scales: &[ParameterScale],
    mean: &[f32],
    log_variance: &[f32],
) -> ([f64; ROPE_PARAMETERS], [f64; ROPE_PARAMETERS]) {
    let span = |i: usize| scales[i].max - scales[i].min;
    (
        core::array::from_fn(|i| scales[i].min + f64::from(mean[i]) * span(i)),
        core::array::from_fn(|i| {
            // A deviation beyond the range or far below a thousandth of it is the
            // estimate's own error.
            let deviation = (f64::from(log_variance[i]) / 2.0).exp();
            deviation.clamp(1e-4, 1.0) * span(i)
        }),
    )
}
