//! Where a command's words and results go: pipes that close, disks that are
//! full, results to standard output, links and pipes in the place of files.

use super::support::{command, has, json_in, said, wag_in};
use std::fs::{self, File};
use std::os::unix::fs::FileTypeExt;
use std::process::Command;

const HEADER: &str = "t,q1,q2,q3,q4,q5,q6,q7";

#[test]
fn a_reader_who_leaves_early_changes_nothing_about_the_work() {
    let dir = tempfile::tempdir().unwrap();
    for json in ["", "--json"] {
        let line = format!("wiggle --csv w.csv {json}");
        let mut command = command(&line);
        let mut child = command.current_dir(dir.path()).spawn().unwrap();
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
    let mut command = command("wiggle --csv w.csv");
    command.current_dir(dir.path()).stdout(full);
    let output = command.output().unwrap();
    let said = said(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("standard output"), "{said}");
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn a_result_can_go_to_standard_output_and_stands_there_alone() {
    let dir = tempfile::tempdir().unwrap();
    let output = wag_in(dir.path(), "wiggle --csv /dev/stdout");
    assert!(output.status.success(), "{}", said(&output));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(text.starts_with(HEADER));
    for line in text.lines().skip(1) {
        assert_eq!(line.split(',').count(), 8, "{line}");
    }
    let said = said(&output);
    assert!(said.contains("joint positions"), "{said}");
}

#[test]
fn pipes_and_links_stay_what_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let pipe = dir.path().join("pipe");
    let made = Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    let mut command = command("wiggle --csv pipe");
    let child = command.current_dir(dir.path()).spawn().unwrap();
    let text = fs::read_to_string(&pipe).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert!(text.starts_with(HEADER));
    assert!(pipe.symlink_metadata().unwrap().file_type().is_fifo());

    fs::write(dir.path().join("real.csv"), "").unwrap();
    std::os::unix::fs::symlink("real.csv", dir.path().join("link.csv")).unwrap();
    let output = wag_in(dir.path(), "wiggle --csv link.csv");
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
        let output = wag_in(dir.path(), line);
        assert_eq!(output.status.code(), Some(2));
        let reported: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(reported["ok"], false);
        assert!(said(&output).starts_with("error: "), "{}", said(&output));
    }
}

#[test]
fn a_dry_run_needs_no_arm_and_connects_to_nothing() {
    let dir = tempfile::tempdir().unwrap();
    for command in ["wiggle", "latency"] {
        let reported = json_in(dir.path(), &format!("{command} --dry-run"));
        assert_eq!(reported["ok"], true, "{reported}");
    }
    let output = wag_in(dir.path(), "wiggle --dry-run");
    let page = String::from_utf8_lossy(&output.stdout).into_owned();
    let words = ["nothing moves", "250 setpoints a second", "Tightest: "];
    has(&page, &words);
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
}
