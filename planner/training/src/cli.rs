//! The command line: four steps and their arguments.

use clap::{Args, Parser, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Trains the network that reads rope parameters from a filmed wiggle.
#[derive(Debug, Parser)]
#[command(version, about)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) step: Step,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Step {
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
pub(crate) struct DataArguments {
    /// Configuration of data and training.
    #[arg(long, default_value = "configs/planner/training.toml")]
    pub(crate) config: PathBuf,
    /// Folder of the simulated ropes.
    #[arg(long, default_value = "runs/phi/data")]
    pub(crate) data: PathBuf,
    /// Threads that simulate ropes and film them.
    #[arg(long, default_value_t = 1)]
    pub(crate) threads: usize,
}

#[derive(Debug, Args)]
pub(crate) struct DatasetArguments {
    #[command(flatten)]
    pub(crate) data: DataArguments,
    /// First shard of the training ropes to make here.
    #[arg(long, default_value_t = 0)]
    pub(crate) first: usize,
    /// Shards of the training ropes to make here; all if not given.
    #[arg(long)]
    pub(crate) shards: Option<usize>,
}

#[derive(Debug, Args)]
pub(crate) struct TrainArguments {
    #[command(flatten)]
    pub(crate) data: DataArguments,
    /// Folder of checkpoint, metrics and plots.
    #[arg(long, default_value = "runs/phi/training")]
    pub(crate) out: PathBuf,
    /// What computes.
    #[arg(long, value_enum, default_value = "cpu")]
    pub(crate) device: DeviceName,
    /// End after this many steps of this run, with a checkpoint.
    #[arg(long)]
    pub(crate) pause_after: Option<usize>,
}

#[derive(Debug, Args)]
pub(crate) struct EvaluateArguments {
    #[command(flatten)]
    pub(crate) data: DataArguments,
    /// Folder of the training.
    #[arg(long, default_value = "runs/phi/training")]
    pub(crate) run: PathBuf,
    /// Judge this model file instead of the checkpoint.
    #[arg(long)]
    pub(crate) model: Option<PathBuf>,
    /// Held-out ropes to judge; all if not given.
    #[arg(long)]
    pub(crate) ropes: Option<usize>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ExportArguments {
    #[command(flatten)]
    pub(crate) data: DataArguments,
    /// Folder of the training.
    #[arg(long, default_value = "runs/phi/training")]
    pub(crate) run: PathBuf,
    /// File to write.
    #[arg(long, default_value = "runs/phi/phi-nn.onnx")]
    pub(crate) out: PathBuf,
}

/// What computes.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum DeviceName {
    /// This processor.
    Cpu,
    /// The first NVIDIA card.
    #[cfg(feature = "cuda")]
    Cuda,
    /// The best card there is.
    #[cfg(feature = "wgpu")]
    Wgpu,
}
