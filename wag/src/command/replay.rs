//! `wag replay`: steps the controller's core over a recorded run again and
//! compares every record, bit by bit.

use crate::cli::ReplayArgs;
use anyhow::{Context, anyhow};
use cli_output::{Failure, OrInput, Outcome};
use rt_controller::recording::{Gap, Replay, replay};
use run_log::{Run, explain};
use serde_json::{Value, json};

pub fn run(args: &ReplayArgs, quiet: bool) -> Outcome<Option<Value>> {
    let recording = Run::open(&args.run).and_then(|run| run.recording());
    let recording = recording.or_input()?;
    let found = replay(recording.bytes(), args.from_cycle)
        .with_context(|| format!("`{}`", args.run.display()))
        .or_input()?;
    // The end of a controller at rest is recorded as a stop, but is none.
    let stops = recording.log().map_or(found.causes, |log| {
        let stops = explain(&log).stops;
        let compared = stops.iter().filter(|s| s.cycle >= found.first_cycle);
        compared.count() as u64
    });
    if !quiet {
        print!("{}", show(&found, stops));
    }
    if !found.is_exact() {
        return Err(Failure::failed(anyhow!(verdict(&found))));
    }
    Ok(Some(
        json!({ "ok": true, "command": "replay", "run": args.run, "stops": stops, "replay": found }),
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
    let damage = found
        .gaps
        .iter()
        .find(|g| g.damaged)
        .map(|g| format!("the recording is damaged: {}", g.reason));
    [difference, damage]
        .into_iter()
        .flatten()
        .collect::<Vec<_>>()
        .join("; ")
}

fn show(found: &Replay, stops: u64) -> String {
    let verdict = if found.differing_bytes == 0 {
        "identical".to_owned()
    } else {
        format!("{} bytes differ", found.differing_bytes)
    };
    let mut text = format!(
        "{verdict:<16} {} cycles ({} to {}), with {} whole states and {} stops\n",
        found.cycles, found.first_cycle, found.last_cycle, found.states, stops,
    );
    for gap in &found.gaps {
        text.push_str(&format!("gap              {}\n", describe(gap)));
    }
    if found.skipped > 0 {
        text.push_str(&format!(
            "not compared     {} cycles that follow a gap, up to the next keyframe\n",
            found.skipped
        ));
    }
    if found.core != rt_controller::recording::CORE_VERSION {
        text.push_str(&format!(
            "recorded by      version {}; this is {}\n",
            found.core,
            rt_controller::recording::CORE_VERSION
        ));
    }
    text
}

fn describe(gap: &Gap) -> String {
    let after = gap
        .after_cycle
        .map_or("at the begin".to_owned(), |c| format!("after cycle {c}"));
    let until = gap
        .until_cycle
        .map_or("to the end".to_owned(), |c| format!("until cycle {c}"));
    format!("{after} {until}: {}", gap.reason)
}
