//! Wrong input to every command: exit code 2 (or 1), one clear line that names
//! the file and the field, nothing half-written.
#![cfg(test)]

mod files;
mod machines;
mod records;
mod ropes;

use files::{LINKS, prepare};
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

/// Command line (`%20` is a space within an argument, `LINKS` a model), exit code, words
/// that must be in the error.
type Case = (&'static str, i32, &'static [&'static str]);

#[test]
fn wrong_input_gets_one_clear_line_and_leaves_nothing_behind() {
    let dir = prepare();
    let before = fs::read_dir(dir.path()).unwrap().count();
    let cases = [machines::CASES, records::CASES, ropes::CASES].concat();
    for (line, code, words) in cases {
        let args: Vec<String> = line
            .split_whitespace()
            .map(|arg| arg.replace("%20", " ").replace("LINKS", LINKS))
            .collect();
        let args: Vec<&str> = args.iter().map(String::as_str).collect();
        let output = wag(dir.path(), &args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(code), "wag {line}: {said}");
        for word in words {
            assert!(
                said.contains(word),
                "wag {line}: `{word}` is not in: {said}"
            );
        }
        assert!(!said.contains("panicked"), "wag {line}: {said}");
        let errors = said.lines().filter(|l| l.starts_with("error: ")).count();
        assert_eq!(errors.max(1), 1, "wag {line}: {said}");
        assert_eq!(
            fs::read_dir(dir.path()).unwrap().count(),
            before,
            "wag {line} left something"
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
