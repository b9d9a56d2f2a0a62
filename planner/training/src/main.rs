//! `phi-train` trains Φ-NN, the network that reads rope parameters from a filmed wiggle.
//!
//! It runs four steps, each of which can be run again and goes on where it was
//! interrupted:
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

mod batches;
mod checkpoint;
mod cli;
mod config;
mod draws;
mod error;
mod evaluation;
mod export;
mod familiar;
mod files;
mod graph;
mod hypercube;
mod masking;
mod metrics;
mod network;
mod onnx;
mod plots;
mod pool;
mod principal;
mod standard;
mod steps;
#[cfg(test)]
mod tests;
mod trainer;

use clap::Parser;
use cli::{Arguments, Step};
use std::process::ExitCode;

/// Exits with 2 for input that cannot be used, 1 for work that failed.
fn main() -> ExitCode {
    let done = match Arguments::parse().step {
        Step::Dataset(arguments) => steps::dataset(&arguments),
        Step::Train(arguments) => steps::train(&arguments),
        Step::Evaluate(arguments) => steps::evaluate(&arguments),
        Step::Export(arguments) => steps::export(&arguments),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("phi-train: {error}");
            ExitCode::from(if error.is_input() { 2 } else { 1 })
        }
    }
}
