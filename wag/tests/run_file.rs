//! The file of a run: it opens with any reader, replays to the bit, and survives the
//! death of its recorder, which stops no motion.
#![cfg(test)]

mod support;

use mcap::{MessageStream, Summary};
use rustix::process::Signal;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use support::{Rig, json, process_of, said, send, until_recorded, wag};

/// Runs a wiggle on a simulated arm; `during` sees the run folder and the process.
fn wiggle(run: &Path, during: impl FnOnce(&Path, u32)) -> Output {
    let rig = Rig::start("");
    let child = rig.wiggle(run);
    during(run, child.id());
    child.wait_with_output().unwrap()
}

/// Messages of each topic; all JSON must parse.
fn topics(bytes: &[u8]) -> BTreeMap<String, u64> {
    let mut counts = BTreeMap::new();
    for message in MessageStream::new(bytes).unwrap() {
        let message = message.unwrap();
        if message.channel.message_encoding == "json" {
            serde_json::from_slice::<Value>(&message.data).unwrap();
        }
        *counts.entry(message.channel.topic.clone()).or_insert(0) += 1;
    }
    counts
}

/// The published Python reader agrees, where there is one.
fn python_agrees(file: &Path) {
    let Some(python) = std::env::var_os("WAG_SDK_PYTHON") else {
        eprintln!("skipped: WAG_SDK_PYTHON does not name a Python with mcap and jsonschema");
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/validate-mcap");
    let output = Command::new(python)
        .args([script.as_ref(), file.as_os_str()])
        .args([
            "/arm/measured",
            "/arm/commanded",
            "/controller/cycles",
            "/tf",
            "/scene",
        ])
        .args(["/log", "/wag/replay", "/wag/summary"])
        .output()
        .unwrap();
    let said = said(&output);
    assert!(output.status.success(), "{said}");
}

#[test]
fn a_run_lies_in_one_file_that_replays_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let output = wiggle(&run, |_, _| ());
    let said = said(&output);
    assert!(output.status.success(), "{said}");
    let file = run.join("run.mcap");
    let bytes = fs::read(&file).unwrap();
    let summary = Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.attachment_indexes.len(), 1);
    let counts = topics(&bytes);
    println!("{} bytes, {counts:?}", bytes.len());
    assert!(
        counts["/arm/measured"] > 1000 && counts["/tf"] > 200,
        "{counts:?}"
    );
    assert_eq!(counts["/wag/summary"], 1);
    python_agrees(&file);
    let replayed = json(&format!("replay {}", run.display()))["replay"].clone();
    assert_eq!(replayed["differing_bytes"], 0, "{replayed}");
    let nowhere = wag(&format!("export csv {} --out none", run.display()));
    assert_eq!(nowhere.status.code(), Some(2), "a folder that is not there");
    let tables = json(&format!("export csv {}", run.display()));
    assert_eq!(tables["cycles"], replayed["cycles"]);
    let rows = fs::read_to_string(run.join("cycles.csv")).unwrap();
    assert_eq!(
        rows.lines().count() as u64 - 1,
        tables["cycles"].as_u64().unwrap()
    );
    let reports = fs::read_to_string(run.join("joints.csv")).unwrap();
    assert_eq!(
        reports.lines().count() as u64 - 1,
        tables["joints"].as_u64().unwrap()
    );
    let exact = tables["cycles"].as_u64().unwrap();
    assert!(
        counts["/controller/cycles"].abs_diff(exact) < 500,
        "{exact} cycles, {counts:?}"
    );
    let told = json(&format!("record recover {}", file.display()));
    assert_eq!(told["recovered"]["was_whole"], true);
    assert_eq!(fs::read(&file).unwrap(), bytes);
    ledger_knows(folder.path(), &run);
}

/// The run is listed, told how it was made, a broken one beside it hides nothing, and a folder
/// that is none is left out.
fn ledger_knows(runs: &Path, run: &Path) {
    fs::create_dir_all(runs.join("broken/no-run")).unwrap();
    fs::create_dir(runs.join("no-run")).unwrap();
    fs::write(runs.join("broken/command.json"), "{").unwrap();
    let (csv, places) = (runs.join("runs.csv"), runs.display());
    let told = json(&format!("ledger {places} --csv {}", csv.display()));
    let listed = told["runs"].as_array().unwrap();
    assert_eq!(listed.len(), 2, "{told:#}");
    assert_eq!(listed[0]["result"], "broken");
    assert_eq!(listed[1]["result"], "ok");
    assert_eq!(listed[1]["arguments"][0], "wiggle");
    assert_eq!(fs::read_to_string(&csv).unwrap().lines().count(), 3);
    let only = json(&format!("ledger {places} --result ok"));
    assert_eq!(only["runs"].as_array().unwrap().len(), 1);
    let run = run.display().to_string();
    let again = json(&format!("ledger rerun {run}"));
    let words: Vec<&str> = again["arguments"]
        .as_array()
        .unwrap()
        .iter()
        .map(|w| w.as_str().unwrap())
        .collect();
    assert_eq!(words[..2], ["wiggle", "--arm"]);
    assert!(
        !words.contains(&"--out") && !words.contains(&run.as_str()),
        "{words:?}"
    );
    let same = json(&format!("ledger compare {run} {run}"));
    assert_eq!(same["differences"], Value::Array(Vec::new()));
    // The arm is gone by now: making the run again fails as it would by hand.
    let gone = wag(&format!("ledger rerun {run} --go"));
    let said = said(&gone);
    assert_eq!(gone.status.code(), Some(1), "{said}");
    assert_eq!(
        fs::read_dir(runs.join("runs")).unwrap().count(),
        1,
        "where it was made"
    );
}

#[test]
fn a_killed_recorder_stops_nothing_and_at_most_a_second_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let mut killed_ns = 0;
    let output = wiggle(&run, |run, pid| {
        // Well into the motion.
        until_recorded(run, 900);
        let recorder = process_of(&pid.to_string(), "recorder").expect("there is a recorder");
        killed_ns = std::time::SystemTime::now()
            .duration_since(std::time::UNIX_EPOCH)
            .unwrap()
            .as_nanos();
        send(recorder, Signal::KILL);
    });
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    for words in [
        "the run continues",
        "killed by signal 9",
        "wag record recover",
    ] {
        assert!(said.contains(words), "`{words}` is not in: {said}");
    }
    let told: Value = serde_json::from_slice(&fs::read(run.join("summary.json")).unwrap()).unwrap();
    assert_eq!(told["ok"], true, "the motion was finished");

    let file = run.join("run.mcap");
    let name = file.display().to_string();
    assert!(!matches!(
        Summary::read(&fs::read(&file).unwrap()),
        Ok(Some(_))
    ));
    // Reading commands take it as it is.
    assert_eq!(
        json(&format!("replay {name}"))["replay"]["differing_bytes"],
        0
    );
    let found = json(&format!("record recover {name}"))["recovered"].clone();
    assert_eq!(
        (&found["was_whole"], &found["damaged"]),
        (&Value::from(false), &Value::from(0))
    );
    let bytes = fs::read(&file).unwrap();
    let summary = Summary::read(&bytes).unwrap().unwrap();
    let last_ns = u128::from(summary.stats.unwrap().message_end_time);
    let missing_ms = killed_ns.saturating_sub(last_ns) / 1_000_000;
    println!("{missing_ms} ms before the kill are missing, {found}");
    assert!(missing_ms < 1000, "{missing_ms} ms are missing");
    assert!(topics(&bytes)["/controller/cycles"] > 500);
}
