//! What every benchmark prints.

use crate::args::BenchArgs;
use crate::report::joined;
use cli_output::Machine;
use serde_json::{Value, json};

/// Prints the machine and the tables, and returns what `--json` prints: `own` fields in
/// addition to those of every benchmark.
pub fn report(args: &BenchArgs, command: &str, own: Value, print: impl FnOnce()) -> Option<Value> {
    let machine = Machine::here();
    println!("{machine}");
    print();
    let common = json!({
        "ok": true, "command": command, "machine": machine, "seed": args.seed,
        "quick": args.quick,
    });
    Some(joined(common, own))
}

/// Whether a time limit (s) was kept.
pub fn verdict(limit_s: f64, kept: bool) -> String {
    format!("{limit_s} s {}", if kept { "kept" } else { "exceeded" })
}
