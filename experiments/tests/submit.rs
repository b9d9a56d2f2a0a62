//! Studies in shards: the bytes of one process, whoever makes them and whatever is killed.
#![cfg(test)]

mod support;

use serde_json::Value;
use std::path::Path;
use std::process::Command;
use support::{assert_refused, report};

const EXPERIMENTS: &str = env!("CARGO_BIN_EXE_experiments");

fn sysid(ropes: u32, more: &str) -> String {
    format!("sysid --ropes {ropes} --seed 3 --method nn {more}")
}

/// The result file of one process.
fn by_one(dir: &Path, ropes: u32) -> Vec<u8> {
    let path = dir.join("one.json");
    report(&sysid(ropes, &format!("--out {}", path.display())));
    std::fs::read(path).unwrap()
}

#[test]
fn shards_joined_by_hand_are_as_one_process() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name).display().to_string();
    let one = by_one(dir.path(), 5);
    for shard in 1..=3 {
        let out = at(&format!("{shard}.json"));
        let made = report(&sysid(5, &format!("--shard {shard}/3 --out {out}")));
        assert_eq!(made["shard"], format!("{shard}/3"));
    }
    let merge = |shards: &str| format!("merge --out {} {shards}", at("all.json"));
    let three = ["2.json", "3.json", "1.json"].map(at).join(" ");
    assert_eq!(report(&merge(&three))["trials"], 5);
    assert_eq!(std::fs::read(at("all.json")).unwrap(), one);
    let result = report(&sysid(5, &format!("--out {}", at("all.json"))));
    assert_eq!(result["summary"]["trials"], 5);
    assert_refused(&merge(&at("1.json")), &["shard 2/3 is missing"]);
    assert_refused(&sysid(5, "--shard 1/3"), &["--out"]);
    let other = sysid(5, &format!("--shard 1/2 --out {}", at("1.json")));
    assert_refused(&other, &["1.json", "shard 1/3"]);
}

/// What a submission gives; what follows its `--` is the study's.
fn made(line: &str) -> Value {
    let mut command = Command::new(EXPERIMENTS);
    let output = command
        .arg("--json")
        .args(line.split_whitespace())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {said}");
    serde_json::from_slice(&output.stdout).expect("standard output is JSON")
}

fn submit(dir: &Path, ropes: u32, shards: u32) -> String {
    let out = dir.join("all.json");
    let out = out.display();
    let study = sysid(ropes, "");
    format!("submit --workers 2 --shards {shards} --out {out} -- {study}")
}

#[test]
fn processes_of_this_machine_make_a_study_and_go_on_with_it() {
    let dir = tempfile::tempdir().unwrap();
    let one = by_one(dir.path(), 7);
    let line = submit(dir.path(), 7, 3);
    let first = made(&line);
    assert_eq!(first["trials"], 7);
    assert_eq!(first["result"]["summary"]["trials"], 7);
    let all = dir.path().join("all.json");
    assert_eq!(std::fs::read(&all).unwrap(), one);
    // What is made is not made again; a shard that was lost is.
    let folder = dir.path().join("all.json.shards");
    let kept = std::fs::read(folder.join("shard-1.json")).unwrap();
    for name in ["shard-2.json", "shard-2.done"] {
        std::fs::remove_file(folder.join(name)).unwrap();
    }
    std::fs::remove_file(&all).unwrap();
    assert_eq!(made(&line)["trials"], 7);
    assert_eq!(std::fs::read(&all).unwrap(), one);
    assert_eq!(std::fs::read(folder.join("shard-1.json")).unwrap(), kept);
    let other = submit(dir.path(), 7, 4);
    let number = "another number of shards 3, not 4:";
    assert_refused(&other, &["all.json.shards", number]);
    let other = submit(dir.path(), 8, 3);
    assert_refused(&other, &["another study [", "\"7\"", "\"8\""]);
}

/// The number of shards that a line prepares; it runs none.
fn prepared(dir: &Path, options: &str, study: &str) -> Value {
    let out = dir.join("all.json");
    made(&format!(
        "submit --prepare {options} --out {} -- {study}",
        out.display()
    ))["shards"]
        .clone()
}

#[test]
fn a_folder_keeps_its_number_of_shards_and_without_trials_takes_another_study() {
    let dir = tempfile::tempdir().unwrap();
    let prepared = |options: &str, study: &str| prepared(dir.path(), options, study);
    assert_eq!(prepared("--workers 2", "sysid --ropes 40"), 8);
    assert_eq!(prepared("--workers 3", "sysid --ropes 40"), 8);
    assert_eq!(prepared("--workers 3 --shards 5", "sysid --ropes 40"), 5);
    assert_eq!(prepared("--workers 3", "sysid --ropes 41"), 12);
    // At most one for each trial.
    assert_eq!(prepared("--workers 3 --shards 100", "sysid --ropes 3"), 3);
    let per_wiggle = "wiggle-ablation --ropes 3";
    assert_eq!(prepared("--workers 3 --shards 20", per_wiggle), 20);
    // A queue may be making the trials of a shard that has no mark yet.
    std::fs::write(dir.path().join("all.json.shards/shard-1.json"), "{}").unwrap();
    assert_eq!(prepared("--workers 4", per_wiggle), 20);
    let out = dir.path().join("all.json");
    let other = format!(
        "submit --prepare --workers 3 --out {} -- sysid",
        out.display()
    );
    assert_refused(
        &other,
        &["another study [\"wiggle-ablation\",", "[\"sysid\"]"],
    );
}

#[test]
fn a_wrong_study_is_refused_before_anything_is_started() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("all.json");
    for (study, word) in [
        ("-- nostudy --ropes 40", "unrecognized subcommand 'nostudy'"),
        (
            "-- sysid --rope 40",
            "argument '--rope' found; tip: a similar argument exists: '--ropes'\n",
        ),
        ("-- sysid --ropes many", "invalid value 'many'"),
        ("-- rooms", "`rooms` has no shards"),
        ("-- submit --help", "`submit` has no shards"),
        ("-- real-dlo DIR", "`real-dlo` has no shards"),
        ("-- sysid --help", "ask without submit"),
        ("-- sysid --shard 1/8", "`--shards N` before --"),
        ("-- sysid --shards=8", "`--shards N` before --"),
        ("sysid --ropes 4", "put -- before the study"),
    ] {
        let line = format!("submit --workers 2 --out {} {study}", out.display());
        assert_refused(&line, &[word]);
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{line}");
    }
}

#[test]
fn what_a_shard_says_is_kept_and_told() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("all.json");
    let line = format!(
        "submit --workers 2 --shards 2 --retries 1 --out {} -- sysid --ropes 2 --model nothing.onnx",
        out.display()
    );
    let output = Command::new(EXPERIMENTS)
        .args(line.split_whitespace())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("2 of 2 shards failed 2 times"), "{said}");
    let log = std::fs::read_to_string(dir.path().join("all.json.shards/shard-1.log")).unwrap();
    assert!(log.contains("nothing.onnx"), "{log}");
    let last = log.lines().last().unwrap();
    assert!(said.contains(&format!("the first is 1: {last}")), "{said}");
    assert!(!out.exists());
    for own in ["--threads 2", "--threads=2", "--json"] {
        let line = format!("submit --workers 2 --out {} -- sysid {own}", out.display());
        assert_refused(&line, &["--", "before --"]);
    }
}
