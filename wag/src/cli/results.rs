//! Arguments of what measures.

use clap::{Args, ValueEnum};
use cli_output::seed;

#[derive(Debug, Args)]
pub struct BenchArgs {
    /// What to measure.
    #[arg(value_enum)]
    pub name: BenchName,
    /// Seconds instead of a minute, rough figures.
    #[arg(long)]
    pub quick: bool,
    /// Seed of the simulated rig of `record`.
    #[arg(long, default_value_t = 5, allow_negative_numbers = true, value_parser = seed)]
    pub seed: u64,
    /// `rt`, `record`: time of each contender (s).
    #[arg(long, default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..=86_400))]
    pub seconds: u32,
    /// `rt`: core of the control loop; default: the last one.
    #[arg(long)]
    pub cpu: Option<usize>,
}

/// Benchmarks known by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BenchName {
    /// The control loop: wake-up latency compared with `cyclictest`, times within a cycle.
    Rt,
    /// Recording: times within a control cycle without and with the recorder.
    Record,
}
