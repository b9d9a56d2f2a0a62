//! State of a training in one file, from which it goes on bit for bit.

use crate::config::TrainingConfig;
use crate::error::{Result, TrainingError};
use crate::files::{read, sealed, unsealed, write_whole};
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
pub(crate) struct Progress {
    /// Steps done.
    pub(crate) step: usize,
    /// The configuration it runs under.
    pub(crate) config: TrainingConfig,
    /// Mean and scale of the features.
    pub(crate) standard: Standard,
    /// Hash of the pool's motions (SHA-256, hexadecimal).
    pub(crate) data_sha256: String,
    /// Sum of the losses since the last line of the metrics.
    pub(crate) loss_sum: f64,
    /// Number of these losses.
    pub(crate) losses: u32,
}

/// A training that can go on.
pub(crate) struct State {
    pub(crate) progress: Progress,
    pub(crate) model: PhiModel,
    /// Adam with its moments.
    pub(crate) optimizer: ModuleOptimizer,
}

/// Adam as the paper has it.
pub(crate) fn adam() -> ModuleOptimizer {
    AdamConfig::new().with_epsilon(1e-8).init()
}

/// The checkpoint in the folder of a training.
pub(crate) fn path_in(folder: &Path) -> PathBuf {
    folder.join("checkpoint.phi")
}

impl State {
    /// Writes the checkpoint, whole or not at all.
    pub(crate) fn save(&self, path: &Path) -> Result<()> {
        let json = serde_json::to_vec(&self.progress).map_err(|e| TrainingError::file(path, e))?;
        let model = self.model.clone().into_record().into_bytes();
        let optimizer = self.optimizer.to_record().into_bytes();
        let parts = [
            json,
            model.map_err(TrainingError::tensors)?.to_vec(),
            optimizer.map_err(TrainingError::tensors)?.to_vec(),
        ];
        let mut out = MAGIC.to_vec();
        for part in &parts {
            out.extend_from_slice(&(part.len() as u64).to_le_bytes());
            out.extend_from_slice(part);
        }
        write_whole(path, &sealed(out))
    }

    /// Reads a checkpoint to go on from it. The moments go to the tensor library's default
    /// device until the next step: a card if it was built for one.
    pub(crate) fn load(path: &Path, device: &Device) -> Result<Self> {
        let (mut state, moments) = Self::without_moments(path, device)?;
        let record = OptimizerRecord::from_bytes(Bytes::from_bytes_vec(moments))
            .map_err(TrainingError::tensors)?;
        state.optimizer = state.optimizer.load_record(record);
        Ok(state)
    }

    /// Reads a checkpoint to judge or to write its network, on this processor and without
    /// a card even if built for one. Adam is new.
    pub(crate) fn load_weights(path: &Path) -> Result<Self> {
        let (state, _) = Self::without_moments(path, &Device::flex().autodiff())?;
        Ok(state)
    }

    /// Reads a checkpoint; what is in it of Adam as it stands there.
    fn without_moments(path: &Path, device: &Device) -> Result<(Self, Vec<u8>)> {
        let bytes = read(path)?;
        let damaged = || {
            let reason = "not a checkpoint, or damaged: remove it to start over";
            TrainingError::file(path, reason)
        };
        let body = unsealed(&bytes).and_then(|body| body.strip_prefix(MAGIC));
        let mut rest = body.ok_or_else(damaged)?;
        let mut part = || {
            let (size, after) = rest.split_first_chunk::<8>()?;
            let size = usize::try_from(u64::from_le_bytes(*size)).ok()?;
            let (part, after) = after.split_at_checked(size)?;
            rest = after;
            Some(part.to_vec())
        };
        let (Some(json), Some(model), Some(moments)) = (part(), part(), part()) else {
            return Err(damaged());
        };
        let progress: Progress = serde_json::from_slice(&json).map_err(|error| {
            let reason = format!("written by another version ({error}): remove it to start over");
            TrainingError::file(path, reason)
        })?;
        let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(model))
            .map_err(TrainingError::tensors)?;
        let network = &progress.config.network;
        let model = PhiModel::new(network, &progress.config.features(), device)
            .try_load_record(record)
            .map_err(TrainingError::tensors)?;
        let state = Self {
            progress,
            model,
            optimizer: adam(),
        };
        Ok((state, moments))
    }
}
