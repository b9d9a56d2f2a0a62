//! Φ-NN: rope parameters from one look at a filmed wiggle.
//!
//! The network comes from an ONNX file that `phi-train` wrote (crate
//! `phi-training`), with metadata that say what its numbers mean. It runs in an
//! embedded runtime in pure Rust, or in a native ONNX Runtime library where
//! `ORT_DYLIB_PATH` names one. Files that were not written by `phi-train`, or not
//! for these features and parameters, or were damaged since, are refused.

#[cfg(feature = "network")]
mod estimate;
mod file;
mod metadata;
#[cfg(feature = "network")]
mod net;
mod probe;
#[cfg(feature = "network")]
mod propose;

#[cfg(feature = "network")]
pub use estimate::{NetworkError, identify_by_network};
pub use metadata::{
    FORMAT, METADATA_KEY, ModelError, ParameterScale, PhiMetadata, ProbeOutputs, TrainingRecord,
    graph_sha256, hex,
};
#[cfg(feature = "network")]
pub use net::{PhiNet, PredictError, Prediction, RawOutputs};
#[cfg(feature = "network")]
pub use propose::{HybridError, identify_with_network, proposal};

pub use probe::{PARITY, difference, probe};

/// Names of the network's inputs: motion `[n, frames, channels]`, widths `[n, 4]`.
pub const INPUTS: [&str; 2] = ["motion", "widths"];
/// Names of its outputs: normalised parameters `[n, 9]`, logarithm of their
/// variances `[n, 9]`, embedding `[n, 256]`, oddity `[n, 1]`: the mean squared
/// deviation of the embedding from those of known ropes, in their own deviations.
pub const OUTPUTS: [&str; 4] = ["mean", "log_variance", "embedding", "oddity"];
