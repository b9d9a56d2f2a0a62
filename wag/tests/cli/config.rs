//! Configuration of a site's or a rig's folder, as users lay it over the built-in one.

use super::support::{command, has, said};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

/// `wag` beside the folder that is a rig's.
fn wag(rig: &Path, line: &str) -> Output {
    let mut command = command(line);
    command.current_dir(rig.parent().unwrap());
    command.env("WAG_CONFIG", rig).output().unwrap()
}

#[test]
fn a_rig_s_file_holds_for_every_command_and_says_where_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let rig = dir.path().join("rig");
    fs::create_dir(&rig).unwrap();
    fs::write(rig.join("limits.toml"), "tcp_speed_max_m_s = 0.5\n").unwrap();
    let shown = wag(&rig, "--json config show limits --origin");
    assert_eq!(shown.status.code(), Some(0), "{shown:?}");
    let shown: Value = serde_json::from_slice(&shown.stdout).unwrap();
    let values = shown["values"].as_array().unwrap();
    let of = |key: &str| values.iter().find(|v| v["key"] == key).unwrap();
    assert_eq!(of("tcp_speed_max_m_s")["value"], 0.5);
    assert_eq!(of("tcp_speed_max_m_s")["layer"], "rig");
    assert_eq!(of("velocity_max_rad_s")["layer"], "built in");

    // The wiggle keeps what holds: it cannot be made so slowly.
    fs::write(rig.join("limits.toml"), "tcp_speed_max_m_s = 0.01\n").unwrap();
    let slow = wag(&rig, "wiggle --csv wiggle.csv");
    assert_ne!(slow.status.code(), Some(0), "{}", said(&slow));
    fs::remove_file(rig.join("limits.toml")).unwrap();
    let usual = wag(&rig, "wiggle --csv wiggle.csv");
    assert_eq!(usual.status.code(), Some(0), "{}", said(&usual));
}

#[test]
fn a_wrong_file_is_named_by_check_and_stops_a_run_before_it_begins() {
    let dir = tempfile::tempdir().unwrap();
    let rig = dir.path().join("rig");
    fs::create_dir(&rig).unwrap();
    fs::write(rig.join("planner.toml"), "[search]\npopulaton = 40\n").unwrap();
    for line in ["config check", "config show planner", "demo --out run"] {
        let output = wag(&rig, line);
        let said = said(&output);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        has(&said, &["rig/planner.toml", "line 2", "populaton"]);
        has(&said, &["did you mean `population`?"]);
    }
    assert!(!dir.path().join("run").exists());
    fs::write(rig.join("planner.toml"), "[search]\npopulation = 40\n").unwrap();
    assert_eq!(wag(&rig, "config check").status.code(), Some(0));
    // The layer that is wrong is named, not the one below.
    let many = "[search]\npopulation = \"many\"\n";
    fs::write(dir.path().join("mine.toml"), many).unwrap();
    let over = said(&wag(&rig, "config check planner mine.toml"));
    assert!(over.contains("mine.toml"), "{over}");
    let gone = wag(&dir.path().join("gone"), "config check");
    assert_eq!(gone.status.code(), Some(2), "{gone:?}");
}
