//! What reads a recorded run: `wag replay`, `wag explain`, `wag report`.

use crate::config;
use anyhow::Context;
use cli_output::{OrInput, Outcome, is_interrupted, output};
use rt_controller::recording::{CORE_VERSION, Gap, Replay};
use run_log::{Explanation, Run, Stop};
use serde_json::{Value, json};
use shared_types::FaultCode;
use std::path::Path;

/// Steps the controller's core over a run again and compares every record, bit by bit.
pub fn replay(run: &Path, from_cycle: u64) -> Outcome<Option<Value>> {
    let recording = Run::open(run).and_then(|run| run.recording());
    let recording = recording.or_input()?;
    let found = rt_controller::recording::replay(recording.bytes(), from_cycle)
        .with_context(|| format!("`{}`", run.display()))
        .or_input()?;
    // The end of a controller at rest is recorded as a stop, but is none.
    let stops = recording.log().map_or(found.causes, |log| {
        let stops = run_log::explain(&log).stops;
        let compared = stops.iter().filter(|s| s.cycle >= found.first_cycle);
        compared.count() as u64
    });
    print_replay(&found, stops);
    if !found.is_exact() {
        return Err(failed!(verdict(&found)));
    }
    Ok(Some(
        json!({ "ok": true, "command": "replay", "run": run, "stops": stops, "replay": found }),
    ))
}

/// What is wrong, in one line.
fn verdict(found: &Replay) -> String {
    let difference = found.first_difference.as_ref().map(|first| {
        format!(
            "{} bytes differ, first in cycle {}, field `{}`: recorded {}, replayed {}",
            found.differing_bytes,
            first.cycle,
            first.unequal.field,
            first.unequal.recorded,
            first.unequal.replayed
        )
    });
    let damaged = found.gaps.iter().find(|g| g.damaged);
    let damage = damaged.map(|g| format!("the recording is damaged: {}", g.reason));
    let both: Vec<String> = [difference, damage].into_iter().flatten().collect();
    both.join("; ")
}

fn print_replay(found: &Replay, stops: u64) {
    let verdict = match found.differing_bytes {
        0 => "identical".to_owned(),
        bytes => format!("{bytes} bytes differ"),
    };
    println!(
        "{verdict:<16} {} cycles ({} to {}), with {} keyframes and {stops} stops",
        found.cycles, found.first_cycle, found.last_cycle, found.states,
    );
    for gap in &found.gaps {
        println!("gap              {}", describe(gap));
    }
    if found.skipped > 0 {
        println!(
            "not compared     {} cycles that follow a gap, up to the next keyframe",
            found.skipped
        );
    }
    if found.core != CORE_VERSION {
        println!(
            "recorded by      version {}; this is {CORE_VERSION}",
            found.core
        );
    }
}

fn describe(gap: &Gap) -> String {
    let after = gap.after_cycle.map(|c| format!("after cycle {c}"));
    let after = after.unwrap_or_else(|| "at the begin".to_owned());
    let until = gap.until_cycle.map(|c| format!("until cycle {c}"));
    let until = until.unwrap_or_else(|| "to the end".to_owned());
    format!("{after} {until}: {}", gap.reason)
}

/// Why a run was stopped, or how close it came to its limits.
pub fn explain(path: &Path) -> Outcome<Option<Value>> {
    let run = Run::open(path).or_input()?;
    let summary = run.summary().ok().flatten().unwrap_or_default();
    let log = run.recording().and_then(|recording| recording.log());
    let found = log.map(|log| run_log::explain(&log));
    if let Some(error) = summary["error"].as_str()
        && !found.as_ref().is_ok_and(|found| found.stopped)
    {
        println!("FAILED: {error}\n");
    }
    let found = found.or_input()?;
    print!("{}", run_log::show(&found));
    Ok(Some(json!({
        "ok": true, "command": "explain", "run": path, "run_error": summary["error"], "explanation": found,
    })))
}

/// Keeps the explanation of a run that was stopped and shows it to people.
pub fn explain_stop(run: &Path) {
    let cause = Run::open(run).ok().and_then(|run| run.keep_cause());
    // Who interrupted it knows why it stopped, if nothing else stopped it before.
    let by_user =
        |stop: &Stop| matches!(stop.code, FaultCode::OperatorStop | FaultCode::OperatorLost);
    let known = |found: &Explanation| is_interrupted() && found.stops.iter().all(by_user);
    if let Some(found) = cause.filter(|found| found.stopped && !known(found)) {
        output::remark(format_args!("{}", run_log::show(&found).trim_end()));
    }
}

/// A run as one HTML file.
pub fn report(run: &Path, out: Option<&Path>) -> Outcome<Option<Value>> {
    let here = config::cell_here().or_input()?;
    let written = viewer::report::write(run, out, &here).or_input()?;
    let megabytes = written.bytes as f64 / 1e6;
    println!("{} ({megabytes:.1} MB)", written.path.display());
    for missing in &written.missing {
        output::remark(format_args!("not in this run: {missing}"));
    }
    Ok(Some(json!({
        "ok": true, "command": "report", "run": run, "out": written.path,
        "bytes": written.bytes, "missing": written.missing,
    })))
}
