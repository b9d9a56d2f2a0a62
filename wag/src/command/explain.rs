//! `wag explain`: why a run was stopped, or how close it came to its limits.

use crate::cli::ExplainArgs;
use cli_output::{OrInput, Outcome};
use run_log::{Run, explain, keep_cause, show};
use serde_json::{Value, json};
use std::path::Path;

pub fn run(args: &ExplainArgs, quiet: bool) -> Outcome<Option<Value>> {
    let run = Run::open(&args.run).or_input()?;
    let found = explain(&run.log().or_input()?);
    if !quiet {
        print!("{}", show(&found));
    }
    Ok(Some(
        json!({ "ok": true, "command": "explain", "run": args.run, "explanation": found }),
    ))
}

/// Keeps the explanation of a run that was stopped and shows it, unless `quiet`.
pub fn explain_stop(run: &Path, quiet: bool) {
    if let Some(found) = keep_cause(run)
        && found.stopped
        && !quiet
    {
        eprint!("{}", show(&found));
    }
}
