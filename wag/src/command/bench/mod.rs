//! `wag bench NAME`: how punctual the controller is on this machine.
//!
//! A benchmark measures and compares with limits; it does not judge: the exit code
//! is 0 whatever the figures are.

mod record;
mod rt;

use crate::cli::{BenchArgs, BenchName};
use cli_output::Outcome;
use serde_json::Value;

/// Runs a benchmark. The value is what `--json` prints.
pub fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    match args.name {
        BenchName::Rt => rt::run(args),
        BenchName::Record => record::run(args),
    }
}
