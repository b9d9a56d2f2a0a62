//! `wag ledger`: runs listed, compared, made again.

use crate::cli::{LedgerArgs, LedgerCommand};
use anyhow::{Context, anyhow};
use cli_output::{Failure, OrInput, Outcome, output, table};
use comfy_table::ContentArrangement;
use run_log::files;
use run_log::ledger::{self, Entry, RUNS};
use run_log::{Run, quoted};
use serde_json::{Value, json};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

pub fn run(args: &LedgerArgs) -> Outcome<Option<Value>> {
    match &args.instead {
        Some(LedgerCommand::Compare { first, second }) => compare(first, second),
        Some(LedgerCommand::Rerun { run, go }) => rerun(run, *go),
        None => list(args),
    }
}

fn list(args: &LedgerArgs) -> Outcome<Option<Value>> {
    let mut places = args.places.clone();
    // Before the first run the default folder is not there, which is no mistake.
    if places.is_empty() && Path::new(RUNS).exists() {
        places.push(PathBuf::from(RUNS));
    }
    let mut entries = ledger::find(&places).or_input()?;
    let command = args.command.as_deref();
    let plan = args.plan.as_ref().map(|hash| hash.to_lowercase());
    let of_plan = |e: &Entry, hash: &str| {
        let found = e.plan_sha256.as_ref();
        found.is_some_and(|found| found.starts_with(hash))
    };
    entries.retain(|e| {
        args.result.is_none_or(|result| e.result == result)
            && command.is_none_or(|c| e.command() == Some(c))
            && args.seed.is_none_or(|seed| e.seed == Some(seed))
            && plan.as_deref().is_none_or(|hash| of_plan(e, hash))
    });
    if let Some(path) = &args.csv {
        let text = ledger::csv(&entries).or_failed()?;
        files::write_atomic(path, &text).or_failed()?;
    }
    if entries.is_empty() {
        println!("no runs: name run folders or folders of them, or make one with `wag demo`");
    } else {
        println!("{}", ledger::table(&entries));
        for entry in &entries {
            for problem in &entry.problems {
                println!("{}: {problem}", entry.run.display());
            }
        }
        let s = if entries.len() == 1 { "" } else { "s" };
        println!("{} run{s}", entries.len());
    }
    Ok(Some(
        json!({ "ok": true, "command": "ledger", "runs": entries, "csv": args.csv }),
    ))
}

fn known(run: &Path) -> Outcome<Entry> {
    if ledger::is_run(run) {
        return ledger::read(run).or_input();
    }
    Err(bad_input!(
        "`{}` is not a run folder; `wag ledger` lists those of `{RUNS}`",
        run.display()
    ))
}

fn compare(first: &Path, second: &Path) -> Outcome<Option<Value>> {
    let (first, second) = (known(first)?, known(second)?);
    let found = ledger::compare(&first, &second).or_failed()?;
    let rows = found.iter().map(|d| {
        let by =
            d.by.map_or_else(|| "-".to_owned(), |by| format!("{by:+.4e}"));
        [
            d.what.clone(),
            d.first.to_string(),
            d.second.to_string(),
            by,
        ]
    });
    let mut shown = table::numbers(["value", "first", "second", "by"], 0, rows);
    shown.set_content_arrangement(ContentArrangement::Dynamic);
    println!("{}", shown.set_width(100));
    let plural = if found.len() == 1 { "" } else { "s" };
    println!("{} difference{plural}", found.len());
    Ok(Some(json!({
        "ok": true, "command": "ledger compare", "first": first, "second": second, "differences": found,
    })))
}

fn rerun(run: &Path, go: bool) -> Outcome<Option<Value>> {
    known(run)?;
    let command = Run::open(run).and_then(|run| run.command());
    let line = command.or_input()?.ok_or_else(|| {
        bad_input!(
            "`{}` does not say how it was made: it holds no {}",
            run.display(),
            files::COMMAND
        )
    })?;
    let mut again = line.again();
    if go {
        if output::is_json() && !again.iter().any(|word| word == "--json") {
            again.push("--json".to_owned());
        }
        let program = std::env::current_exe()
            .context("cannot find this program's own file")
            .or_failed()?;
        // Comes back only when it could not be started: what it prints and how it
        // ends are its own.
        let reason = Command::new(program)
            .args(&again)
            .current_dir(&line.working_directory)
            .exec();
        return Err(Failure::failed(anyhow!(reason).context(format!(
            "cannot run `wag {}` in `{}`",
            quoted(&again),
            line.working_directory.display()
        ))));
    }
    let folder = line.working_directory.display().to_string();
    println!("cd {} && wag {}", quoted(&[folder]), quoted(&again));
    Ok(Some(json!({
        "ok": true, "command": "ledger rerun", "run": run, "arguments": again,
        "working_directory": line.working_directory, "version": line.version,
    })))
}
