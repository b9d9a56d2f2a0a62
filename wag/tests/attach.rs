//! Others find a running rig and a running controller: ports at once, one rig
//! per domain, a recorder that needs no domain's name, nothing left behind.
#![cfg(test)]

mod support;

use std::fs;
use support::{Rig, json, said, until_recorded, wag};

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
    let filming = format!("--rope random --camera {domain}");
    let first = Rig::start(&filming);
    assert_ne!(first.told["command_port"], 0);
    let line = format!("rig --command-port 0 --report-ports 0,0,0,0 {filming}");
    let second = wag(&line);
    let refusal = said(&second);
    assert_eq!(second.status.code(), Some(1), "{refusal}");
    assert!(
        refusal.contains(&domain) && refusal.contains("in use by another rig"),
        "{refusal}"
    );
    assert!(second.stdout.is_empty(), "it never listened");
    let (code, rest) = first.end();
    assert_eq!((code, rest.as_str()), (Some(0), ""));
    assert_eq!(shared_memory_of(&domain), Vec::<String>::new());
}

#[test]
fn a_recorder_finds_the_controller_of_a_run_and_names_those_that_run() {
    let folder = tempfile::tempdir().unwrap();
    let (path, late_path) = (folder.path().join("run"), folder.path().join("late"));
    let (run, late) = (path.display(), late_path.display());
    let rig = Rig::start("");
    let wiggle = rig.wiggle(&path);
    until_recorded(&path, 200);
    let domain = format!("run-{}", wiggle.id());
    let nobody = format!("nobody-{}", std::process::id());
    let lost = wag(&format!(
        "record --domain {nobody} --seconds 0.1 --out {late}"
    ));
    assert_eq!(lost.status.code(), Some(1), "{}", said(&lost));
    assert!(said(&lost).contains(&domain), "{}", said(&lost));
    assert!(!late_path.exists(), "nothing recorded, nothing left");
    assert_eq!(shared_memory_of(&nobody), Vec::<String>::new());

    let told = json(&format!("record {run} --seconds 2 --out {late}"));
    assert_eq!(told["domain"], domain.as_str());
    assert!(told["recording"]["chunks"].as_u64().unwrap() > 0);

    let output = wiggle.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    // The end of a session is no stop: not in the log, not in the count.
    let log = fs::read_to_string(path.join("log/rt-controller.log")).unwrap();
    assert!(
        !log.contains("WARN stopped") && !log.contains("OperatorStop"),
        "{log}"
    );
    let replay = wag(&format!("replay {run}"));
    let text = String::from_utf8(replay.stdout).unwrap();
    assert!(text.contains("and 0 stops"), "{text}");
    let gone = wag(&format!("record {run}"));
    let refusal = said(&gone);
    assert_eq!(gone.status.code(), Some(1), "{refusal}");
    assert!(refusal.contains("does not run any more"), "{refusal}");
}
