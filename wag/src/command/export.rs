//! `wag export`: a recorded run in other formats.

use crate::cli::{ExportCommand, ExportCsvArgs};
use crate::files;
use anyhow::anyhow;
use cli_output::{Failure, OrInput, Outcome};
use run_log::Run;
use serde_json::{Value, json};
use std::path::Path;

pub fn run(command: &ExportCommand, quiet: bool) -> Outcome<Option<Value>> {
    match command {
        ExportCommand::Csv(args) => csv(args, quiet),
    }
}

fn csv(args: &ExportCsvArgs, quiet: bool) -> Outcome<Option<Value>> {
    let recorded = Run::open(&args.run).or_input()?.cycles().or_input()?;
    let folder = if args.run.is_dir() {
        &*args.run
    } else {
        args.run.parent().unwrap_or(Path::new("."))
    };
    let first = recorded.cycles.first().ok_or_else(|| {
        Failure::input(anyhow!("`{}` holds no control cycle", args.run.display()))
    })?;
    let epoch_ns = epoch_ns(folder).or_input()?.unwrap_or(first.deadline_ns);
    let out = args.out.as_deref().unwrap_or(folder);
    recorded.write_tables(out, epoch_ns).or_failed()?;
    let measured = run_log::measured(&recorded.joints).len();
    if !quiet {
        println!(
            "{} cycles and {measured} joint reports in `{}`",
            recorded.cycles.len(),
            out.display()
        );
    }
    Ok(Some(json!({
        "ok": true, "command": "export csv", "run": args.run, "epoch_ns": epoch_ns,
        "cycles": recorded.cycles.len(), "joints": measured,
        "folder": out,
    })))
}

/// Zero of the run's other files (CLOCK_MONOTONIC ns), if its summary has one.
fn epoch_ns(folder: &Path) -> anyhow::Result<Option<u64>> {
    let path = folder.join("summary.json");
    if !path.is_file() {
        return Ok(None);
    }
    let summary: Value = serde_json::from_str(&files::read_text(&path)?)
        .map_err(|reason| anyhow!("`{}` is no JSON: {reason}", path.display()))?;
    Ok(summary["epoch_ns"].as_u64().filter(|ns| *ns > 0))
}
