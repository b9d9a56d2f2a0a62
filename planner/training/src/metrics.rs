//! What is measured while a network is trained.

use serde::{Deserialize, Serialize};
use shared_types::rope::ROPE_PARAMETERS;

/// A line of `metrics.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metric {
    /// Steps done.
    pub step: usize,
    /// Learning rate of the last of them.
    pub learning_rate: f64,
    /// Mean loss since the line before.
    pub loss: f64,
    /// Loss on held-out ropes, and mean absolute error of each parameter as a part
    /// of its range.
    pub held_out: Option<(f64, [f64; ROPE_PARAMETERS])>,
}
