//! `wag explain`: why a run was stopped, or how close it came to its limits.

use crate::cli::ExplainArgs;
use crate::recording::{Flight, explain, read_recording, show};
use anyhow::Context;
use cli_output::{OrInput, Outcome};
use serde_json::{Value, json};

pub fn run(args: &ExplainArgs, quiet: bool) -> Outcome<Option<Value>> {
    let bytes = read_recording(&args.run).or_input()?;
    let flight = Flight::read(&bytes)
        .with_context(|| format!("`{}`", args.run.display()))
        .or_input()?;
    let found = explain(&flight);
    if !quiet {
        print!("{}", show(&found));
    }
    Ok(Some(
        json!({ "ok": true, "command": "explain", "run": args.run, "explanation": found }),
    ))
}
