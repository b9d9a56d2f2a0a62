//! `wag export`: a recorded run in other formats.

use crate::cli::{ExportCommand, ExportCsvArgs};
use anyhow::anyhow;
use cli_output::{Failure, OrInput, Outcome};
use run_log::{CYCLES_TABLE, Run, files};
use serde_json::{Value, json};

pub fn run(command: &ExportCommand, quiet: bool) -> Outcome<Option<Value>> {
    match command {
        ExportCommand::Csv(args) => csv(args, quiet),
    }
}

fn csv(args: &ExportCsvArgs, quiet: bool) -> Outcome<Option<Value>> {
    let run = Run::open(&args.run).or_input()?;
    let recording = run.recording().or_input()?;
    let recorded = recording.cycles().or_input()?;
    let first = recorded.cycles.first().ok_or_else(|| {
        Failure::input(anyhow!("`{}` holds no control cycle", args.run.display()))
    })?;
    // Zero of the run's other files, if its summary has one.
    let epoch_ns = run.summary().or_input()?.unwrap_or_default()["epoch_ns"].as_u64();
    let epoch_ns = epoch_ns.filter(|ns| *ns > 0).unwrap_or(first.deadline_ns);
    let out = args.out.as_deref().unwrap_or(run.folder());
    files::check_writable(&out.join(CYCLES_TABLE)).or_input()?;
    let [cycles, joints] = recorded.write_tables(out, epoch_ns).or_failed()?;
    if !quiet {
        println!(
            "{cycles} cycles and {joints} joint reports in `{}`",
            out.display()
        );
    }
    Ok(Some(json!({
        "ok": true, "command": "export csv", "run": args.run, "epoch_ns": epoch_ns,
        "cycles": cycles, "joints": joints, "folder": out,
    })))
}
