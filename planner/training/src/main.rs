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

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;
use std::process::ExitCode;

/// Trains the network that reads rope parameters from a filmed wiggle.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    step: Step,
}

#[derive(Debug, Subcommand)]
enum Step {
    /// Simulate the ropes; shards that exist already are kept.
    Dataset(DatasetArguments),
    /// Train the network, from its last checkpoint if there is one.
    Train(TrainArguments),
    /// Compare predictions with the truth on held-out ropes.
    Evaluate(EvaluateArguments),
    /// Write the network as ONNX and check the file against it.
    Export(ExportArguments),
}

/// Where ropes come from.
#[derive(Debug, Args)]
struct DataArguments {
    /// Configuration of data and training.
    #[arg(long, default_value = "configs/planner/training.toml")]
    config: PathBuf,
    /// Folder of the simulated ropes.
    #[arg(long, default_value = "runs/phi/data")]
    data: PathBuf,
    /// Threads that simulate ropes and film them.
    #[arg(long, default_value_t = 1)]
    threads: usize,
}

#[derive(Debug, Args)]
struct DatasetArguments {
    #[command(flatten)]
    data: DataArguments,
    /// First shard of the training ropes to make here.
    #[arg(long, default_value_t = 0)]
    first: usize,
    /// Shards of the training ropes to make here; all if not given.
    #[arg(long)]
    shards: Option<usize>,
}

#[derive(Debug, Args)]
struct TrainArguments {
    #[command(flatten)]
    data: DataArguments,
    /// Folder of checkpoint, metrics and plots.
    #[arg(long, default_value = "runs/phi/training")]
    out: PathBuf,
    /// What computes.
    #[arg(long, value_enum, default_value = "cpu")]
    device: DeviceName,
    /// End after this many steps of this run, with a checkpoint.
    #[arg(long)]
    pause_after: Option<usize>,
}

#[derive(Debug, Args)]
struct EvaluateArguments {
    #[command(flatten)]
    data: DataArguments,
    /// Folder of the training.
    #[arg(long, default_value = "runs/phi/training")]
    run: PathBuf,
    /// Judge this model file instead of the checkpoint.
    #[arg(long)]
    model: Option<PathBuf>,
    /// Held-out ropes to judge; all if not given.
    #[arg(long)]
    ropes: Option<usize>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct ExportArguments {
    #[command(flatten)]
    data: DataArguments,
    /// Folder of the training.
    #[arg(long, default_value = "runs/phi/training")]
    run: PathBuf,
    /// File to write.
    #[arg(long, default_value = "runs/phi/phi-nn.onnx")]
    out: PathBuf,
}

/// What computes.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum DeviceName {
    /// This processor.
    Cpu,
    /// The first NVIDIA card.
    #[cfg(feature = "cuda")]
    Cuda,
    /// The best card there is.
    #[cfg(feature = "wgpu")]
    Wgpu,
}

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
