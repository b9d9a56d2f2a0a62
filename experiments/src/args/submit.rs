//! Arguments of what makes and joins shards.

use clap::Args;
use std::path::PathBuf;

/// Arguments of `experiments merge`.
#[derive(Debug, Args)]
pub struct MergeArgs {
    /// Result file (JSON): that of the whole study, byte for byte.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// Files of all shards, in any order.
    #[arg(required = true, value_name = "SHARD")]
    pub shards: Vec<PathBuf>,
}

/// Arguments of `experiments submit`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: experiments submit --workers 16 --out sysid.json -- sysid --ropes 10000 --seed 2\nInterrupted, the same command goes on: shards that are done are not made again."
)]
pub struct SubmitArgs {
    /// Shards that run at once, at most.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub workers: u32,
    /// Shards of the study; default: four for each worker, so that none waits long for the last.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub shards: Option<u64>,
    /// Threads, and so processors, of a shard.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// Write the script that makes a shard, and start none: for a cluster's queue.
    #[arg(long)]
    pub prepare: bool,
    /// How often shards that failed are tried again.
    #[arg(long, default_value_t = 2)]
    pub retries: u32,
    /// Result file (JSON). Shards lie beside it, in a folder of its name with `.shards`.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// The study and its own arguments, without --out, --shard and --threads.
    #[arg(last = true, required = true, value_name = "STUDY")]
    pub study: Vec<String>,
}
