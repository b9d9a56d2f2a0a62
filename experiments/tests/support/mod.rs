//! The program run with a line of arguments.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "every test file compiles its own copy"
)]

#[path = "../../../hil-tests/support/missing.rs"]
pub mod missing;

use serde_json::Value;
use std::process::{Command, Output};

fn experiments(line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_experiments"));
    command.args(line.split_whitespace()).output().unwrap()
}

/// The one JSON object that a line gives.
pub fn report(line: &str) -> Value {
    let output = experiments(&format!("{line} --json"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {said}");
    serde_json::from_slice(&output.stdout).expect("standard output is JSON")
}

/// Asserts that a line is refused as bad input, in these words on standard error.
pub fn assert_refused(line: &str, words: &[&str]) {
    let output = experiments(line);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{line}: {said}");
    for word in words {
        assert!(said.contains(word), "{line}: {said} lacks {word}");
    }
}
