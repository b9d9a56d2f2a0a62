//! Wrong input to every command: exit code 2 (or 1), one clear line that names
//! the file and the field, nothing half-written.
#![cfg(test)]

mod files;
mod machines;
mod records;
mod ropes;
#[path = "../support/mod.rs"]
mod support;

use files::{LINKS, prepare};
use std::fs;
use support::{refused_in, wag_in};

/// Command line (`LINKS` is a model), exit code, words
/// that must be in the error.
type Case = (&'static str, i32, &'static [&'static str]);

#[test]
fn wrong_input_gets_one_clear_line_and_leaves_nothing_behind() {
    let dir = prepare();
    let before = fs::read_dir(dir.path()).unwrap().count();
    let sim_rope = ropes::SIM_ROPE.iter().map(|(rope, pose, words)| {
        let line = format!("sim rope --rope {rope} --pose {pose} --fps 60 --out o.npy");
        (line, 2, *words)
    });
    let cases = [machines::CASES, records::CASES, ropes::CASES].concat();
    let cases = cases
        .into_iter()
        .map(|(line, code, words)| (line.to_owned(), code, words));
    for (line, code, words) in cases.chain(sim_rope) {
        let said = refused_in(dir.path(), code, &line.replace("LINKS", LINKS));
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
    let line = format!("rig --command-port {port} --report-ports 0,0,0,0");
    let said = refused_in(dir.path(), 1, &line);
    assert!(said.contains(&port), "{said}");
}

#[test]
fn json_errors_are_json_and_no_runs_are_no_error() {
    let dir = tempfile::tempdir().unwrap();
    let ledger = wag_in(dir.path(), "ledger");
    let said = String::from_utf8_lossy(&ledger.stdout);
    assert!(
        ledger.status.success() && said.contains("no runs"),
        "{said}"
    );
    let output = wag_in(dir.path(), "check none.json --json");
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["ok"], false);
    assert!(told["error"].as_str().unwrap().contains("none.json"));
}
