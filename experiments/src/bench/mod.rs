//! `experiments bench NAME`: how fast this machine runs a part of the system.
//!
//! A benchmark measures and compares with limits; it does not judge: the exit code
//! is 0 whatever the figures are.

mod identify;
mod library;
mod plan;
mod rope;
mod spent;
mod track;

use crate::args::{BenchArgs, BenchName};
use cli_output::Outcome;
use serde_json::Value;

/// Runs a benchmark. The value is what `--json` prints.
pub fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    match args.name {
        BenchName::Rope => rope::run(args),
        BenchName::Identify => identify::run(args),
        BenchName::Plan => plan::run(args),
        BenchName::Library => library::run(args),
        BenchName::Track => track::run(args),
    }
}
