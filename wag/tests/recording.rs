//! A run on the simulated arm is recorded; replay finds no difference, explain
//! says why it was stopped or how close it came to its limits; a recorder may
//! attach at any time.
#![cfg(test)]

mod support;

use serde_json::Value;
use std::fs;
use std::path::Path;
use support::{Rig, json, said, until_recorded, wag};

/// Replays a run and returns how many cycles were compared.
fn replays_exactly(run: &str) -> u64 {
    let told = json(&format!("replay {run}"));
    let found = &told["replay"];
    assert_eq!(found["differing_bytes"], 0, "{found}");
    assert_eq!(found["gaps"].as_array().unwrap().len(), 0, "{found}");
    assert_eq!(found["skipped"], 0, "{found}");
    assert_eq!(found["first_cycle"], 1, "{found}");
    found["cycles"].as_u64().unwrap()
}

#[test]
fn a_stopped_run_is_explained_and_replays_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let faults = folder.path().join("faults.toml");
    let script = "[[fault]]\non = \"setpoint:700\"\nkind = \"raise_error\"\ncode = 31\n";
    fs::write(&faults, script).unwrap();
    let rig = Rig::start(&format!("--faults {}", faults.display()));
    let path = folder.path().join("run");
    let run = path.display().to_string();
    let output = rig.wiggle(&path).wait_with_output().unwrap();
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("STOPPED: ArmError"), "{said}");

    assert!(replays_exactly(&run) > 500);
    let told = json(&format!("explain {run}"));
    let found = &told["explanation"];
    assert_eq!(found["stopped"], true);
    let stops = found["stops"].as_array().unwrap();
    assert_eq!(stops.len(), 1, "{found:#}");
    let stop = &stops[0];
    assert_eq!(stop["arm_error"], 31, "{stop:#}");
    assert!(stop["around"].as_array().unwrap().len() >= 8, "{stop:#}");
    let kept: Value = serde_json::from_slice(&fs::read(path.join("cause.json")).unwrap()).unwrap();
    assert_eq!(&kept, found);
    let page = String::from_utf8(wag(&format!("explain {run}")).stdout).unwrap();
    println!("{page}");
    for word in ["what happened", "what to do", "until ms", "C31"] {
        assert!(page.contains(word), "`{word}` is not in\n{page}");
    }
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
    let output = wag(&format!("replay {name}"));
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("damaged"), "{said}");
    fs::write(&file, &whole[..whole.len() * 2 / 3]).unwrap();
    let told = json(&format!("replay {name}"));
    assert_eq!(told["replay"]["differing_bytes"], 0);
    assert_eq!(told["replay"]["gaps"].as_array().unwrap().len(), 1);
}

#[test]
fn a_whole_run_shows_its_margins_and_a_recorder_may_join_late() {
    let folder = tempfile::tempdir().unwrap();
    let rig = Rig::start("");
    let path = folder.path().join("run");
    let wiggle = rig.wiggle(&path);
    let late = folder.path().join("late").display().to_string();
    attach_late(&path, wiggle.id(), &late);
    let output = wiggle.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let run = path.display().to_string();
    assert!(replays_exactly(&run) > 1000);
    let told = json(&format!("explain {run}"));
    let found = &told["explanation"];
    assert_eq!(found["stopped"], false, "{found:#}");
    assert_eq!(found["ended_in_order"], true, "{found:#}");
    let margins = found["margins"].as_array().unwrap();
    let speed = margins.iter().find(|m| m["what"] == "joint speed").unwrap();
    let part = speed["part"].as_f64().unwrap();
    assert!(part > 0.01 && part <= 1.0, "{speed}");
    assert!(!path.join("cause.json").exists());
    let page = String::from_utf8(wag(&format!("explain {run}")).stdout).unwrap();
    println!("{page}");
    assert!(page.contains("NOT STOPPED"), "{page}");
    let told = json(&format!("replay {late}"));
    let found = &told["replay"];
    assert_eq!(found["differing_bytes"], 0, "{found}");
    assert!(found["first_cycle"].as_u64().unwrap() > 1, "{found}");
    assert!(found["cycles"].as_u64().unwrap() > 100, "{found}");
    let file = format!("{late}/run.mcap");
    let told = json(&format!("record recover {file}"));
    assert_eq!(told["recovered"]["was_whole"], true, "{told}");
}

/// Records one and a half seconds of a run under way.
fn attach_late(run: &Path, pid: u32, out: &str) {
    until_recorded(run, 400);
    let output = wag(&format!(
        "record --domain run-{pid} --seconds 2.5 --out {out}"
    ));
    assert!(output.status.success(), "{}", said(&output));
}

#[test]
fn a_recorder_without_a_controller_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("late").display().to_string();
    let domain = format!("nobody-{}", std::process::id());
    let output = wag(&format!(
        "record --domain {domain} --seconds 0.2 --out {out}"
    ));
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("no controller runs"), "{said}");
    assert!(
        !Path::new(&out).exists(),
        "nothing recorded is nothing to keep"
    );
}
