//! State of a training in one file, from which it goes on bit for bit.

use crate::TrainingError;
use crate::config::TrainingConfig;
use crate::files::{read, write_whole};
use crate::network::PhiModel;
use crate::standard::Standard;
use burn::module::Module;
use burn::optim::{AdamConfig, ModuleOptimizer, OptimizerRecord};
use burn::store::ModuleRecord;
use burn::tensor::{Bytes, Device};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"PHICKPT1";

/// What a training knows besides its weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Progress {
    /// Steps done.
    pub step: usize,
    /// The configuration it runs under.
    pub config: TrainingConfig,
    /// Mean and scale of the features.
    pub standard: Standard,
    /// Hash of the pool's motions (SHA-256, hexadecimal).
    pub data_sha256: String,
    /// Sum of the losses since the last line of the metrics.
    pub loss_sum: f64,
    /// Number of these losses.
    pub losses: u32,
}

/// A training that can go on.
#[derive(Debug)]
pub struct State {
    /// What it knows besides its weights.
    pub progress: Progress,
    /// The weights.
    pub model: PhiModel,
    /// Adam with its moments.
    pub optimizer: Optimizer,
}

/// Adam as the paper has it.
pub struct Optimizer(pub ModuleOptimizer);

impl core::fmt::Debug for Optimizer {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Optimizer").finish_non_exhaustive()
    }
}

impl Default for Optimizer {
    fn default() -> Self {
        Self(AdamConfig::new().with_epsilon(1e-8).init())
    }
}

/// The checkpoint in the folder of a training.
#[must_use]
pub fn path_in(folder: &Path) -> PathBuf {
    folder.join("checkpoint.phi")
}

fn tensors(error: impl core::fmt::Display) -> TrainingError {
    TrainingError::Tensors {
        reason: error.to_string(),
    }
}

impl State {
    /// Writes the checkpoint, whole or not at all.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), TrainingError> {
        let json = serde_json::to_vec(&self.progress)
            .map_err(|error| TrainingError::bad_file(path, error.to_string()))?;
        let model = self.model.clone().into_record().into_bytes();
        let optimizer = self.optimizer.0.to_record().into_bytes();
        let parts = [
            json,
            model.map_err(tensors)?.to_vec(),
            optimizer.map_err(tensors)?.to_vec(),
        ];
        let mut out = MAGIC.to_vec();
        for part in &parts {
            out.extend_from_slice(&(part.len() as u64).to_le_bytes());
            out.extend_from_slice(part);
        }
        let checksum = crc32fast::hash(&out);
        out.extend_from_slice(&checksum.to_le_bytes());
        write_whole(path, &out)
    }

    /// Reads a checkpoint.
    ///
    /// # Errors
    /// A file that cannot be read, or is damaged.
    pub fn load(path: &Path, device: &Device) -> Result<Self, TrainingError> {
        let bytes = read(path)?;
        let damaged = || {
            TrainingError::bad_file(
                path,
                "not a checkpoint, or damaged: remove it to start over",
            )
        };
        let (body, checksum) = bytes.split_last_chunk::<4>().ok_or_else(damaged)?;
        if crc32fast::hash(body) != u32::from_le_bytes(*checksum) {
            return Err(damaged());
        }
        let mut rest = body.strip_prefix(MAGIC).ok_or_else(damaged)?;
        let mut part = || {
            let (size, after) = rest.split_first_chunk::<8>().ok_or_else(damaged)?;
            let size = usize::try_from(u64::from_le_bytes(*size))
                .ok()
                .ok_or_else(damaged)?;
            let (part, after) = after.split_at_checked(size).ok_or_else(damaged)?;
            rest = after;
            Ok::<_, TrainingError>(part.to_vec())
        };
        let progress: Progress = serde_json::from_slice(&part()?).map_err(|error| {
            let reason = format!("written by another version ({error}): remove it to start over");
            TrainingError::bad_file(path, reason)
        })?;
        let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(part()?)).map_err(tensors)?;
        let network = &progress.config.network;
        let model = PhiModel::new(network, &progress.config.features(), device)
            .try_load_record(record)
            .map_err(tensors)?;
        let record =
            OptimizerRecord::from_bytes(Bytes::from_bytes_vec(part()?)).map_err(tensors)?;
        Ok(Self {
            progress,
            model,
            optimizer: Optimizer(Optimizer::default().0.load_record(record)),
        })
    }
}
