//! Arguments of what makes and joins shards.

use clap::{Args, ValueEnum};
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

/// What runs shards.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum EngineName {
    /// Processes of this machine.
    Local,
    /// A HyperQueue server and its workers.
    Hyperqueue,
    /// A Slurm cluster: an array job.
    Slurm,
}

/// Arguments of `experiments submit`.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: experiments submit --workers 16 --out sysid.json -- sysid --ropes 10000 --seed 2\nInterrupted, the same command goes on: shards that are done are not made again.\n\nEngines: `hyperqueue` asks the server of HQ_SERVER_DIR, or that in ~/.hq-server; `slurm` takes partition, account and time limit from SBATCH_PARTITION, SBATCH_ACCOUNT and SBATCH_TIMELIMIT. The folder of --out must be seen by all their machines under the same name, and so must this program."
)]
pub struct SubmitArgs {
    /// What runs the shards.
    #[arg(long, value_enum, default_value_t = EngineName::Local)]
    pub engine: EngineName,
    /// Shards that run at once, at most; of HyperQueue, as many as it has workers for.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub workers: u32,
    /// Shards of the study, at most its trials; default: as many as there are already, else four for
    /// each worker, so that none waits long for the last.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=100_000))]
    pub shards: Option<u64>,
    /// Threads, and so processors, of a shard.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: u16,
    /// Write the script that makes a shard, and start none: for another queue.
    #[arg(long)]
    pub prepare: bool,
    /// How often shards that failed are tried again.
    #[arg(long, default_value_t = 2)]
    pub retries: u32,
    /// Python that has the package hyperqueue.
    #[arg(long, value_name = "FILE", default_value = "python3")]
    pub python: PathBuf,
    /// Result file (JSON). Shards lie beside it, in a folder of its name with `.shards`.
    #[arg(long, value_name = "FILE")]
    pub out: PathBuf,
    /// The study and its own arguments, without --out, --shard and --threads.
    #[arg(last = true, required = true, value_name = "STUDY")]
    pub study: Vec<String>,
}
