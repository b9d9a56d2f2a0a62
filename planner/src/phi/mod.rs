//! Φ-NN: rope parameters from one look at a filmed wiggle.
//!
//! The network comes from an ONNX file that `phi-train` wrote (crate
//! `phi-training`), with metadata that say what its numbers mean. Its graph is always
//! the same, so only the weights are read and the layers are written out here: the same
//! bits on every machine, and no runtime. Files that were not written by `phi-train`, or
//! not for these features and parameters, or were damaged since, are refused.

mod encoder;
mod file;
mod metadata;
mod net;
mod probe;

pub use encoder::RawOutputs;
pub use metadata::{
    FORMAT, METADATA_KEY, ModelError, ParameterScale, PhiMetadata, ProbeOutputs, TrainingRecord,
    graph_sha256, hex, in_units,
};
pub use net::{PhiNet, PredictError, Prediction};
pub use probe::{PARITY, difference, probe};

/// Names of the network's inputs: motion `[n, frames, channels]`, widths `[n, 4]`.
pub const INPUTS: [&str; 2] = ["motion", "widths"];
/// Names of its outputs: normalised parameters `[n, 9]`, logarithm of their
/// variances `[n, 9]`, embedding `[n, 256]`, out-of-distribution score `[n, 1]` (named
/// `oddity` in the graph): the mean squared deviation of the embedding from those of known ropes, in their own deviations.
pub const OUTPUTS: [&str; 4] = ["mean", "log_variance", "embedding", "oddity"];
