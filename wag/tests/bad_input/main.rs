//! Wrong input to every command: exit code 2 (or 1), one clear line that names
//! the file and the field, nothing half-written.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "tests may fail loudly"
)]

mod files;
mod machines;
mod records;
mod ropes;

use files::prepare;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn wag(folder: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wag"))
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// Arguments, exit code, words that must be in the error.
type Case = (&'static [&'static str], i32, &'static [&'static str]);

#[test]
fn wrong_input_gets_one_clear_line_and_leaves_nothing_behind() {
    let dir = prepare();
    let before = fs::read_dir(dir.path()).unwrap().count();
    let cases = [machines::CASES, records::CASES, ropes::CASES].concat();
    for (args, code, words) in &cases {
        let output = wag(dir.path(), args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(
            output.status.code(),
            Some(*code),
            "wag {}: {said}",
            args.join(" ")
        );
        for word in *words {
            assert!(
                said.contains(word),
                "wag {}: `{word}` is not in: {said}",
                args.join(" ")
            );
        }
        assert!(!said.contains("panicked"), "wag {}: {said}", args.join(" "));
        let errors = said.lines().filter(|l| l.starts_with("error: ")).count();
        assert_eq!(errors.max(1), 1, "wag {}: {said}", args.join(" "));
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            before,
            "wag {} left something",
            args.join(" ")
        );
    }
}

#[test]
fn a_port_in_use_is_named_with_a_remedy() {
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let dir = tempfile::tempdir().unwrap();
    let output = wag(
        dir.path(),
        &["rig", "--command-port", &port, "--report-ports", "0,0,0,0"],
    );
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(&port), "{said}");
}

#[test]
fn json_errors_are_json() {
    let dir = tempfile::tempdir().unwrap();
    let output = wag(dir.path(), &["check", "none.json", "--json"]);
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["ok"], false);
    assert!(told["error"].as_str().unwrap().contains("none.json"));
}
