//! Wrong input to every command: exit code 2 (or 1), one clear line that names
//! the file and the field, nothing half-written.

use super::cases::{FAILED, FEATURES, MACHINES, RECORDS, ROPES, SIM_ROPE};
use super::files::{LINKS, prepare};
use super::support::{are_refused_in, command, refused_in, said, wag_in};
use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;

#[test]
fn wrong_input_gets_one_clear_line_and_leaves_nothing_behind() {
    let dir = prepare();
    let ropes = ROPES.replace("LINKS", LINKS);
    let sim_rope = SIM_ROPE.replace("--rope", "sim rope --fps 60 --out o.npy --rope");
    let all = [MACHINES, RECORDS, &ropes, &sim_rope];
    for cases in all.into_iter().chain(FEATURES) {
        are_refused_in(dir.path(), 2, cases);
    }
    are_refused_in(dir.path(), 1, FAILED);
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
    assert!(ledger.status.success(), "{said}");
    assert!(said.contains("no runs"), "{said}");
    let output = wag_in(dir.path(), "check none.json --json");
    let reported: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(reported["ok"], false);
    assert!(reported["error"].as_str().unwrap().contains("none.json"));
}

#[test]
fn a_name_that_is_not_utf_8_is_refused_before_anything_is_done() {
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join(OsStr::from_bytes(b"bad\xff.csv"));
    for line in ["wiggle --csv", "explain", "man", "throw --dry-run"] {
        let output = command(line).arg(&name).output().unwrap();
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "wag {line}: {said}");
        assert!(
            said.contains("is not UTF-8") && !said.contains("panicked"),
            "{said}"
        );
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    let mut show = command("config show limits");
    let output = show.env("WAG_CONFIG", &name).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let said = said(&output);
    assert!(said.contains("WAG_CONFIG names"), "{said}");
}

#[test]
fn what_is_no_text_file_is_called_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("binary.json"), [0xff, 0xfe, 0x00]).unwrap();
    for (line, said) in [
        ("check .", "it is a folder"),
        ("check binary.json", "not a text file in UTF-8"),
        ("check none.json", "no such file or folder; check the path"),
        ("check none.json/plan.json", "no such file or folder"),
        (
            "check binary.json/plan.json",
            "a part of its path is a file",
        ),
        ("wiggle --csv no/w.csv", "there is no such folder"),
    ] {
        let refusal = refused_in(folder.path(), 2, line);
        assert!(refusal.contains(said), "wag {line}: {refusal}");
    }
    let refusal = refused_in(folder.path(), 1, "wiggle --csv /dev/full");
    assert!(refusal.contains("no room is left there"), "{refusal}");
}
