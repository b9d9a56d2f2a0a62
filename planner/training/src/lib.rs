//! Trains Φ-NN, the network that reads rope parameters from a filmed wiggle.
//!
//! `phi-train` runs four steps, each of which can be run again and goes on where
//! it was interrupted:
//!
//! 1. `dataset` simulates ropes from a Latin hypercube over the parameter ranges
//!    ([`pool`]) and keeps the paths of their keypoints;
//! 2. `train` films them through fresh noise in every batch ([`batches`]) and fits
//!    the network ([`network`], [`trainer`]);
//! 3. `evaluate` compares predictions with the truth on ropes it never saw
//!    ([`evaluation`]);
//! 4. `export` writes the network as ONNX with what it says about itself
//!    ([`export`]), and checks the file against the network.
//!
//! Ropes, noise, masks and dropout are functions of seed and step alone.
#![forbid(unsafe_code)]
#![cfg_attr(
    test,
    allow(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::float_cmp,
        reason = "tests may fail loudly"
    )
)]

pub mod batches;
pub mod checkpoint;
pub mod config;
mod draws;
mod error;
pub mod evaluation;
pub mod export;
mod familiar;
mod files;
mod graph;
pub mod hypercube;
pub mod masking;
pub mod metrics;
pub mod network;
mod onnx;
pub mod plots;
pub mod pool;
pub mod principal;
mod ratios;
pub mod standard;
pub mod trainer;

pub use error::TrainingError;
