//! A run on the simulated arm and its file: it opens with any reader, replays to the bit,
//! explains the run, lets others join, and survives the death of its recorder, which stops
//! no motion.

#[path = "../../../hil-tests/support/exports.rs"]
mod exports;

use super::support::{
    Rig, alone, command, ended, has, json, missing, process_of, refused_in, said, send,
    shared_memory_of, until, until_recorded, wag,
};
use mcap::{MessageStream, Summary};
use rustix::process::Signal;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, UNIX_EPOCH};

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

/// What a run's file tells as an error (Foxglove's level 4) or worse.
fn errors_told(bytes: &[u8]) -> Vec<String> {
    let messages = MessageStream::new(bytes).unwrap().map(Result::unwrap);
    let log = messages.filter(|message| message.channel.topic == "/log");
    let told = log.map(|message| serde_json::from_slice::<Value>(&message.data).unwrap());
    told.filter(|told| told["level"].as_u64().unwrap() >= 4)
        .map(|told| told["message"].to_string())
        .collect()
}

/// The published Python reader agrees, where there is one.
fn python_agrees(file: &Path) {
    const TOPICS: &str = "/arm/measured /arm/commanded /controller/cycles /tf /scene /log \
                          /wag/replay /wag/summary";
    let Some(python) = missing::named("WAG_SDK_PYTHON", "Python with mcap and jsonschema") else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/validate-mcap");
    let mut python = Command::new(python);
    python.arg(script).arg(file).args(TOPICS.split(' '));
    let output = python.output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

/// A published Python library reads the run's Protobuf, where it is there.
fn protobuf_agrees(run: &Path) {
    const TOPICS: &str = "/arm/measured /arm/commanded /controller/cycles /tf /scene /log";
    let python = missing::named(
        "WAG_SDK_PYTHON",
        "Python with mcap and mcap-protobuf-support",
    );
    let Some(python) = python else {
        return;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../.ci/validate-protobuf");
    let mut python = Command::new(python);
    python.arg(script).arg(run.join("run.mcap"));
    python
        .arg(run.join("run.foxglove.mcap"))
        .args(TOPICS.split(' '));
    let output = python.output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
}

/// Replays a run, which has no gap and begins with a cycle; what was found.
fn replays_exactly(run: &str) -> Value {
    let found = json(&format!("replay {run}"))["replay"].clone();
    assert_eq!(found["differing_bytes"], 0, "{found}");
    assert_eq!(found["gaps"], Value::Array(Vec::new()), "{found}");
    assert_eq!(found["skipped"], 0, "{found}");
    found
}

/// What `wag explain` shows to people contains these words.
fn page_has(run: &str, words: &[&str]) {
    let page = String::from_utf8(wag(&format!("explain {run}")).stdout).unwrap();
    println!("{page}");
    has(&page, words);
}

#[test]
fn a_whole_run_lies_in_one_file_that_replays_to_the_bit_and_others_may_join() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start("");
    let path = folder.path().join("run");
    let wiggle = rig.wiggle(&path);
    others_join(folder.path(), wiggle.id());
    ended(wiggle, 0);
    let named = folder.path().join("named").display().to_string();
    let found = replays_exactly(&named);
    assert!(found["first_cycle"].as_u64().unwrap() > 1, "{found}");
    assert!(found["cycles"].as_u64().unwrap() > 100, "{found}");
    let reported = json(&format!("record recover {named}/run.mcap"));
    assert_eq!(reported["recovered"]["was_whole"], true, "{reported}");
    for name in ["late", "named"] {
        fs::remove_dir_all(folder.path().join(name)).unwrap();
    }
    // The end of a session is no stop: not in the log, not in the count.
    let log = fs::read_to_string(path.join("log/rt-controller.log")).unwrap();
    for word in ["WARN stopped", "OperatorStop"] {
        assert!(!log.contains(word), "{log}");
    }
    let run = path.display().to_string();
    let page = String::from_utf8(wag(&format!("replay {run}")).stdout).unwrap();
    assert!(page.contains("and 0 stops"), "{page}");
    let gone = refused_in(Path::new("."), 1, &format!("record {run}"));
    assert!(gone.contains("does not run any more"), "{gone}");

    let found = json(&format!("explain {run}"))["explanation"].clone();
    assert_eq!(found["stopped"], false, "{found:#}");
    assert_eq!(found["ended_in_order"], true, "{found:#}");
    let margins = found["margins"].as_array().unwrap();
    let speed = margins.iter().find(|m| m["what"] == "joint speed").unwrap();
    let part = speed["part"].as_f64().unwrap();
    assert!(part > 0.01 && part <= 1.0, "{speed}");
    assert!(!path.join("cause.json").exists());
    page_has(&run, &["NOT STOPPED"]);
    its_file_is_whole(&path);
    ledger_knows(folder.path(), &path, rig);
}

/// A recorder finds the controller of a run under way in `folder` and names those that run.
fn others_join(folder: &Path, pid: u32) {
    let (run, late) = (folder.join("run"), folder.join("late"));
    until_recorded(&run, 200);
    let domain = format!("run-{pid}");
    let nobody = format!("nobody-{}", std::process::id());
    let out = late.display();
    let line = format!("record --domain {nobody} --seconds 0.1 --out {out}");
    let lost = refused_in(Path::new("."), 1, &line);
    has(&lost, &["no controller runs", &domain]);
    assert!(!late.exists(), "nothing recorded, nothing left");
    assert_eq!(shared_memory_of(&nobody), Vec::<String>::new());

    let line = format!("record {} --seconds 1.5 --out {out}", run.display());
    let reported = json(&line);
    assert_eq!(reported["domain"], domain.as_str());
    assert!(reported["recording"]["chunks"].as_u64().unwrap() > 0);
    let named = folder.join("named").display().to_string();
    let line = format!("record --domain {domain} --seconds 2 --out {named}");
    json(&line);
}

/// It opens with other readers, and its tables are those of the recorded cycles.
fn its_file_is_whole(run: &Path) {
    let (file, name) = (run.join("run.mcap"), run.display());
    let bytes = fs::read(&file).unwrap();
    let summary = Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.attachment_indexes.len(), 1);
    let counts = topics(&bytes);
    println!("{} bytes, {counts:?}", bytes.len());
    assert!(counts["/arm/measured"] > 1000, "{counts:?}");
    assert!(counts["/tf"] > 200, "{counts:?}");
    assert_eq!(counts["/wag/summary"], 1);
    assert_eq!(errors_told(&bytes), Vec::<String>::new());
    python_agrees(&file);
    let replayed = replays_exactly(&name.to_string());
    assert_eq!(replayed["first_cycle"], 1, "{replayed}");
    let exact = replayed["cycles"].as_u64().unwrap();
    assert!(exact > 1000, "{replayed}");
    // No folder: a file, which is left as it is.
    let export = format!("export csv {name} --out {}", file.display());
    let said = refused_in(Path::new("."), 2, &export);
    assert!(said.contains("run.mcap"), "{said}");
    assert_eq!(fs::read(&file).unwrap(), bytes);
    let tables = json(&format!("export csv {name}"));
    assert_eq!(tables["cycles"], exact);
    for table in ["cycles", "joints"] {
        let rows = fs::read_to_string(run.join(format!("{table}.csv"))).unwrap();
        assert_eq!(tables[table], rows.lines().count() - 1, "{table}");
    }
    json(&format!("export npz {name}"));
    let topics: &[_] = if cfg!(feature = "ros2") {
        json(&format!("export ros2 {name}"));
        &["/joint_states", "/joint_setpoints", "/tf", "/rosout"]
    } else {
        &[]
    };
    exports::agree(run, topics);
    if cfg!(feature = "foxglove") {
        json(&format!("export foxglove {name}"));
        protobuf_agrees(run);
    }
    let shown = counts["/controller/cycles"];
    assert!(shown.abs_diff(exact) < 500, "{exact} cycles, {counts:?}");
    let reported = json(&format!("record recover {}", file.display()));
    assert_eq!(reported["recovered"]["was_whole"], true);
    assert_eq!(fs::read(&file).unwrap(), bytes);
}

/// The run is listed, told how it was made, a broken one beside it hides nothing, and a folder
/// that is none is left out.
fn ledger_knows(runs: &Path, run: &Path, rig: Rig) {
    fs::create_dir_all(runs.join("broken/no-run")).unwrap();
    fs::create_dir(runs.join("no-run")).unwrap();
    fs::write(runs.join("broken/command.json"), "{").unwrap();
    let (csv, places) = (runs.join("runs.csv"), runs.display());
    let reported = json(&format!("ledger {places} --csv {}", csv.display()));
    let listed = reported["runs"].as_array().unwrap();
    assert_eq!(listed.len(), 2, "{reported:#}");
    assert_eq!(listed[0]["result"], "broken");
    assert_eq!(listed[1]["result"], "ok");
    assert_eq!(listed[1]["arguments"][0], "wiggle");
    assert_eq!(fs::read_to_string(&csv).unwrap().lines().count(), 3);
    let only = json(&format!("ledger {places} --result ok"));
    assert_eq!(only["runs"].as_array().unwrap().len(), 1);
    let run = run.display().to_string();
    let again = json(&format!("ledger rerun {run}"));
    let words: Vec<String> = serde_json::from_value(again["arguments"].clone()).unwrap();
    assert_eq!(words[..2], ["wiggle", "--arm"]);
    for word in ["--out", &run] {
        assert!(!words.iter().any(|w| w == word), "{words:?}");
    }
    let same = json(&format!("ledger compare {run} {run}"));
    assert_eq!(same["differences"], Value::Array(Vec::new()));
    let go = format!("ledger rerun {run} --go");
    let again = command(&go).spawn().unwrap();
    let made = || fs::read_dir(runs.join("runs")).map_or(0, Iterator::count);
    until("where it was made", Duration::from_secs(20), || {
        (made() == 1).then_some(())
    });
    send(again.id(), Signal::INT);
    ended(again, 1);
    drop(rig);
    // The arm is gone by now: it fails as it would by hand.
    let gone = refused_in(Path::new("."), 1, &go);
    assert!(gone.contains("cannot connect"), "{gone}");
    assert_eq!(made(), 1);
}

#[test]
fn a_stopped_run_is_explained_and_replays_to_the_bit() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let faults = folder.path().join("faults.toml");
    let script = "[[fault]]\non = \"setpoint:700\"\nkind = \"raise_error\"\ncode = 31\n";
    fs::write(&faults, script).unwrap();
    let rig = Rig::start(&format!("--faults {}", faults.display()));
    let path = folder.path().join("run");
    let run = path.display().to_string();
    let said = ended(rig.wiggle(&path), 1);
    has(&said, &["STOPPED: ArmError"]);

    let replayed = replays_exactly(&run);
    assert_eq!(replayed["first_cycle"], 1, "{replayed}");
    assert!(replayed["cycles"].as_u64().unwrap() > 500, "{replayed}");
    let found = &json(&format!("explain {run}"))["explanation"];
    assert_eq!(found["stopped"], true);
    let stops = found["stops"].as_array().unwrap();
    assert_eq!(stops.len(), 1, "{found:#}");
    let stop = &stops[0];
    assert_eq!(stop["arm_error"], 31, "{stop:#}");
    let around = stop["cycles_around"].as_array().unwrap();
    assert!(around.len() >= 8, "{stop:#}");
    let kept: Value = serde_json::from_slice(&fs::read(path.join("cause.json")).unwrap()).unwrap();
    assert_eq!(&kept, found);
    page_has(&run, &["what happened", "what to do", "until ms", "C31"]);
    a_changed_file_is_noticed(&path);
}

/// One flipped bit is found, a cut file reads up to its last whole chunk.
fn a_changed_file_is_noticed(run: &Path) {
    let recording = run_log::Run::open(run).unwrap().recording().unwrap();
    let whole = recording.bytes();
    let file = run.join("changed.bin");
    let name = file.display().to_string();
    let mut flipped = whole.to_vec();
    flipped[whole.len() / 2] ^= 1;
    fs::write(&file, flipped).unwrap();
    let said = refused_in(Path::new("."), 1, &format!("replay {name}"));
    assert!(said.contains("damaged"), "{said}");
    fs::write(&file, &whole[..whole.len() * 2 / 3]).unwrap();
    let reported = json(&format!("replay {name}"));
    assert_eq!(reported["replay"]["differing_bytes"], 0);
    assert_eq!(reported["replay"]["gaps"].as_array().unwrap().len(), 1);
}

#[test]
fn a_killed_recorder_stops_nothing_and_at_most_a_second_is_missing() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let rig = Rig::start("");
    let wiggle = rig.wiggle(&run);
    // Well into the motion.
    until_recorded(&run, 900);
    let recorder = process_of(&wiggle.id().to_string(), "recorder").unwrap();
    let killed_ns = UNIX_EPOCH.elapsed().unwrap().as_nanos();
    send(recorder, Signal::KILL);
    let said = ended(wiggle, 1);
    has(&said, &["the run continues", "killed by signal 9"]);
    has(&said, &["wag record recover"]);
    let reported: Value =
        serde_json::from_slice(&fs::read(run.join("summary.json")).unwrap()).unwrap();
    assert_eq!(reported["ok"], true, "the motion was finished");

    let file = run.join("run.mcap");
    let name = file.display().to_string();
    let unfinished = fs::read(&file).unwrap();
    assert!(!matches!(Summary::read(&unfinished), Ok(Some(_))));
    // Reading commands take it as it is.
    let replayed = json(&format!("replay {name}"));
    assert_eq!(replayed["replay"]["differing_bytes"], 0);
    let found = json(&format!("record recover {name}"))["recovered"].clone();
    assert_eq!(found["was_whole"], false, "{found}");
    assert_eq!(found["damaged"], 0, "{found}");
    let bytes = fs::read(&file).unwrap();
    let summary = Summary::read(&bytes).unwrap().unwrap();
    let last_ns = u128::from(summary.stats.unwrap().message_end_time);
    let missing_ms = killed_ns.saturating_sub(last_ns) / 1_000_000;
    println!("{missing_ms} ms before the kill are missing, {found}");
    assert!(missing_ms < 1000, "{missing_ms} ms are missing");
    assert!(topics(&bytes)["/controller/cycles"] > 500);
}
