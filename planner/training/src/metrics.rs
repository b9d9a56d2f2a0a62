//! What is measured while a network is trained: `metrics.jsonl`.

use crate::error::{Result, TrainingError};
use crate::files::write_whole;
use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;
use std::path::Path;

/// A line of `metrics.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Metric {
    /// Steps done.
    pub(crate) step: usize,
    /// Learning rate of the last of them.
    pub(crate) learning_rate: f64,
    /// Mean loss since the line before.
    pub(crate) loss: f64,
    /// Loss on held-out ropes, and mean absolute error of each parameter as a part
    /// of its range.
    pub(crate) held_out: Option<(f64, [f64; ROPE_PARAMETERS])>,
}

/// The lines up to a step; none if there is no file.
pub(crate) fn read_until(path: &Path, step: usize) -> Result<Vec<Metric>> {
    if step == 0 || !path.exists() {
        return Ok(Vec::new());
    }
    let wrong = |error: &dyn core::fmt::Display| TrainingError::file(path, error);
    let text = std::fs::read_to_string(path).map_err(|error| wrong(&error))?;
    let all: Vec<Metric> = text
        .lines()
        .map(|line| serde_json::from_str(line).map_err(|error| wrong(&error)))
        .collect::<Result<_>>()?;
    Ok(all.into_iter().filter(|m| m.step <= step).collect())
}

pub(crate) fn write(path: &Path, metrics: &[Metric]) -> Result<()> {
    let mut text = String::new();
    for metric in metrics {
        let line = serde_json::to_string(metric);
        text += &line.map_err(|error| TrainingError::file(path, error))?;
        text.push('\n');
    }
    write_whole(path, text.as_bytes())
}
