//! `wag report`: a run as one HTML file.

use crate::cli::ReportArgs;
use crate::config;
use cli_output::{OrInput, Outcome};
use serde_json::{Value, json};
use viewer::report;

pub fn run(args: &ReportArgs, quiet: bool) -> Outcome<Option<Value>> {
    let here = config::cell_here().or_input()?;
    let written = report::write(&args.run, args.out.as_deref(), &here).or_input()?;
    if !quiet {
        println!(
            "{} ({:.1} MB)",
            written.path.display(),
            written.bytes as f64 / 1e6
        );
        for missing in &written.missing {
            eprintln!("not in this run: {missing}");
        }
    }
    Ok(Some(json!({
        "ok": true, "command": "report", "run": args.run, "out": written.path,
        "bytes": written.bytes, "missing": written.missing,
    })))
}
