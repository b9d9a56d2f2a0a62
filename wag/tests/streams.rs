//! Where a command's words and results go: pipes that close, disks that are
//! full, results to standard output, links and pipes in the place of files.
#![cfg(test)]

mod support;

use std::fs::{self, File};
use std::io::Read;
use std::os::unix::fs::FileTypeExt;
use std::path::Path;
use std::process::Command;
use support::{command, json_in, refused_in, said};

/// `wag` in a folder.
fn wag(folder: &Path, line: &str) -> Command {
    let mut command = command(line);
    command.current_dir(folder);
    command
}

const HEADER: &str = "t,q1,q2,q3,q4,q5,q6,q7";

#[test]
fn a_reader_who_leaves_early_changes_nothing_about_the_work() {
    let dir = tempfile::tempdir().unwrap();
    for json in ["", "--json"] {
        let line = format!("wiggle --csv w.csv {json}");
        let mut child = wag(dir.path(), &line).spawn().unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert_eq!(said(&output), "");
        let text = fs::read_to_string(dir.path().join("w.csv")).unwrap();
        assert!(text.starts_with(HEADER));
    }
}

#[test]
fn a_full_disk_behind_standard_output_is_one_clear_error() {
    let dir = tempfile::tempdir().unwrap();
    let full = File::options().write(true).open("/dev/full").unwrap();
    let output = wag(dir.path(), "wiggle --csv w.csv")
        .stdout(full)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(
        said(&output).contains("standard output") && !said(&output).contains("panicked"),
        "{}",
        said(&output)
    );
}

#[test]
fn a_result_can_go_to_standard_output_and_stands_there_alone() {
    let dir = tempfile::tempdir().unwrap();
    let output = wag(dir.path(), "wiggle --csv /dev/stdout")
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(text.starts_with(HEADER));
    for line in text.lines().skip(1) {
        assert_eq!(line.split(',').count(), 8, "{line}");
    }
    assert!(
        said(&output).contains("joint positions"),
        "{}",
        said(&output)
    );
}

#[test]
fn pipes_and_links_stay_what_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let pipe = dir.path().join("pipe");
    assert!(
        Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    let child = wag(dir.path(), "wiggle --csv pipe").spawn().unwrap();
    let mut text = String::new();
    File::open(&pipe)
        .unwrap()
        .read_to_string(&mut text)
        .unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(text.starts_with(HEADER));
    assert!(pipe.symlink_metadata().unwrap().file_type().is_fifo());

    fs::write(dir.path().join("real.csv"), "").unwrap();
    std::os::unix::fs::symlink("real.csv", dir.path().join("link.csv")).unwrap();
    let output = wag(dir.path(), "wiggle --csv link.csv").output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    let link = dir.path().join("link.csv").symlink_metadata().unwrap();
    assert!(link.is_symlink());
    let text = fs::read_to_string(dir.path().join("real.csv")).unwrap();
    assert!(text.starts_with(HEADER));
}

#[test]
fn a_wrong_command_line_is_json_where_json_was_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    for line in [
        "fling --json",
        "--json plan strike",
        "demo --json --seed=-1",
    ] {
        let output = wag(dir.path(), line).output().unwrap();
        assert_eq!(output.status.code(), Some(2));
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["ok"], false);
        assert!(said(&output).starts_with("error: "), "{}", said(&output));
    }
}

#[test]
fn a_dry_run_needs_no_arm_and_connects_to_nothing() {
    let dir = tempfile::tempdir().unwrap();
    for command in ["wiggle", "latency"] {
        let told = json_in(dir.path(), &format!("{command} --dry-run"));
        assert_eq!(told["ok"], true, "{told}");
    }
    let output = wag(dir.path(), "wiggle --dry-run").output().unwrap();
    let page = String::from_utf8_lossy(&output.stdout).into_owned();
    for words in ["nothing moves", "250 setpoints a second", "Tightest: "] {
        assert!(page.contains(words), "`{words}` is not in\n{page}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}

/// Command lines and words that must be in the error.
const REFUSED: &[(&str, &[&str])] = &[
    ("demo --seed -1", &["--seed", "whole number from 0"]),
    (
        "identify --keypoints k.json --camera c.toml --pose p.csv --out r.toml --lead-mass -1",
        &["--lead-mass", "above 0"],
    ),
    (
        "identify --keypoints k.json --camera c.toml --pose p.csv --out r.toml --lead-mass nan",
        &["--lead-mass", "above 0"],
    ),
    ("demo --target 0,0,0.2", &["arm's base"]),
    ("demo --rig-config none.toml", &["none.toml"]),
    ("wiggle --dry-run --csv no/w.csv", &["no/w.csv", "folder"]),
    ("wiggle --arm no..host --dry-run", &["no..host"]),
    ("record none", &["none", "no run folder"]),
];

#[test]
fn what_cannot_work_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    for (line, words) in REFUSED {
        let said = refused_in(dir.path(), 2, line);
        for word in *words {
            assert!(said.contains(word), "wag {line}: `{word}` is not in {said}");
        }
        assert!(!said.contains(".tmp"), "{said}");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0, "{line}");
    }
}
