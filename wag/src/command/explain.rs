//! `wag explain`: why a run was stopped, or how close it came to its limits.

use crate::cli::ExplainArgs;
use cli_output::{OrInput, Outcome};
use run_log::{Run, explain, show};
use serde_json::{Value, json};
use std::path::Path;

pub fn run(args: &ExplainArgs, quiet: bool) -> Outcome<Option<Value>> {
    let recording = Run::open(&args.run).and_then(|run| run.recording());
    let log = recording.and_then(|recording| recording.log()).or_input()?;
    let found = explain(&log);
    if !quiet {
        print!("{}", show(&found));
    }
    Ok(Some(
        json!({ "ok": true, "command": "explain", "run": args.run, "explanation": found }),
    ))
}

/// Keeps the explanation of a run that was stopped and shows it, unless `quiet`.
pub fn explain_stop(run: &Path, quiet: bool) {
    if let Some(found) = Run::open(run).ok().and_then(|run| run.keep_cause())
        && found.stopped
        && !quiet
    {
        eprint!("{}", show(&found));
    }
}
