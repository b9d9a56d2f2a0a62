//! Others find a running rig and a running controller: ports at once, one rig
//! per domain, a recorder that needs no domain's name, nothing left behind.
#![cfg(test)]

mod support;

use serde_json::Value;
use std::fs;
use std::path::Path;
use std::thread::sleep;
use std::time::{Duration, Instant};
use support::{Rig, said, wag};

fn shared_memory_of(domain: &str) -> Vec<String> {
    let prefix = format!("wag_{domain}_");
    let files = fs::read_dir("/dev/shm").unwrap().flatten();
    files
        .map(|f| f.file_name().to_string_lossy().into_owned())
        .filter(|name| name.starts_with(&prefix))
        .collect()
}

#[test]
fn a_second_rig_in_a_domain_says_so_and_an_ended_one_leaves_nothing() {
    let domain = format!("cam{}", std::process::id());
    let first = Rig::start(&["--rope", "random", "--camera", &domain]);
    assert_ne!(first.told["command_port"], 0);
    let second = wag(&[
        "rig",
        "--command-port",
        "0",
        "--report-ports",
        "0,0,0,0",
        "--rope",
        "random",
        "--camera",
        &domain,
    ]);
    assert_eq!(second.status.code(), Some(1), "{}", said(&second));
    assert!(
        said(&second).contains(&domain) && said(&second).contains("in use by another rig"),
        "{}",
        said(&second)
    );
    assert!(second.stdout.is_empty(), "it never listened");
    let (code, rest) = first.end();
    assert_eq!((code, rest.as_str()), (Some(0), ""));
    assert_eq!(shared_memory_of(&domain), Vec::<String>::new());
}

/// Waits until a run's controller records.
fn recording(run: &Path) {
    let began = Instant::now();
    while fs::metadata(run.join("cycles.bin")).map_or(0, |m| m.len()) < 100_000 {
        assert!(
            began.elapsed() < Duration::from_secs(60),
            "nothing recorded"
        );
        sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_recorder_finds_the_controller_of_a_run_and_names_those_that_run() {
    let folder = tempfile::tempdir().unwrap();
    let (run, late) = (folder.path().join("run"), folder.path().join("late"));
    let rig = Rig::start(&[]);
    let wiggle = rig.wiggle(&run);
    recording(&run);
    let domain = format!("run-{}", wiggle.id());
    let nobody = format!("nobody-{}", std::process::id());
    let lost = wag(&[
        "record",
        "--domain",
        &nobody,
        "--seconds",
        "0.1",
        "--out",
        late.to_str().unwrap(),
    ]);
    assert_eq!(lost.status.code(), Some(1), "{}", said(&lost));
    assert!(said(&lost).contains(&domain), "{}", said(&lost));
    assert!(!late.exists(), "nothing recorded, nothing left");
    assert_eq!(shared_memory_of(&nobody), Vec::<String>::new());

    let found = wag(&[
        "record",
        run.to_str().unwrap(),
        "--seconds",
        "2",
        "--json",
        "--out",
        late.to_str().unwrap(),
    ]);
    assert!(found.status.success(), "{}", said(&found));
    let told: Value = serde_json::from_slice(&found.stdout).unwrap();
    assert_eq!(told["domain"], domain.as_str());
    assert!(told["recording"]["chunks"].as_u64().unwrap() > 0);

    let output = wiggle.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    // The end of a session is no stop: not in the log, not in the count.
    let log = fs::read_to_string(run.join("log/rt-controller.log")).unwrap();
    assert!(
        !log.contains("WARN stopped") && !log.contains("OperatorStop"),
        "{log}"
    );
    let replay = wag(&["replay", run.to_str().unwrap()]);
    let text = String::from_utf8(replay.stdout).unwrap();
    assert!(text.contains("and 0 stops"), "{text}");
    let gone = wag(&["record", run.to_str().unwrap()]);
    assert_eq!(gone.status.code(), Some(1), "{}", said(&gone));
    assert!(
        said(&gone).contains("does not run any more"),
        "{}",
        said(&gone)
    );
}
