//! Configuration of a site's or a rig's folder, as users lay it over the built-in one.
#![cfg(test)]

use std::path::Path;
use std::process::{Command, Output};

fn wag(rig: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_wag"))
        .current_dir(rig.parent().unwrap())
        .env("WAG_CONFIG", rig)
        .args(args)
        .output()
        .unwrap()
}

fn object(output: &Output) -> serde_json::Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn a_rig_s_file_holds_for_every_command_and_says_where_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let rig = dir.path().join("rig");
    std::fs::create_dir(&rig).unwrap();
    std::fs::write(rig.join("limits.toml"), "tcp_speed_max_m_s = 0.5\n").unwrap();
    let shown = wag(&rig, &["--json", "config", "show", "limits", "--origin"]);
    assert_eq!(shown.status.code(), Some(0), "{shown:?}");
    let shown = object(&shown);
    let values = shown["values"].as_array().unwrap();
    let of = |key: &str| values.iter().find(|v| v["key"] == key).unwrap();
    assert_eq!(of("tcp_speed_max_m_s")["value"], 0.5);
    assert_eq!(of("tcp_speed_max_m_s")["layer"], "rig");
    assert_eq!(of("velocity_max_rad_s")["layer"], "built in");

    // The wiggle keeps what holds: it cannot be made so slowly.
    let csv = dir.path().join("wiggle.csv");
    let written = |rig: &Path| {
        let output = wag(rig, &["wiggle", "--csv", csv.to_str().unwrap()]);
        (
            output.status.code(),
            String::from_utf8_lossy(&output.stderr).into_owned(),
        )
    };
    std::fs::write(rig.join("limits.toml"), "tcp_speed_max_m_s = 0.01\n").unwrap();
    let (code, said) = written(&rig);
    assert_ne!(code, Some(0), "{said}");
    std::fs::remove_file(rig.join("limits.toml")).unwrap();
    let (code, said) = written(&rig);
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_wrong_file_is_named_by_check_and_stops_a_run_before_it_begins() {
    let dir = tempfile::tempdir().unwrap();
    let rig = dir.path().join("rig");
    std::fs::create_dir(&rig).unwrap();
    std::fs::write(rig.join("planner.toml"), "[search]\npopulaton = 40\n").unwrap();
    let run = dir.path().join("run");
    for args in [
        vec!["config", "check"],
        vec!["config", "show", "planner"],
        vec!["demo", "--out", run.to_str().unwrap()],
    ] {
        let output = wag(&rig, &args);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        for part in [
            "rig/planner.toml",
            "populaton",
            "did you mean `population`?",
        ] {
            assert!(said.contains(part), "{args:?} {part}: {said}");
        }
    }
    assert!(!run.exists());
    std::fs::write(rig.join("planner.toml"), "[search]\npopulation = 40\n").unwrap();
    assert_eq!(wag(&rig, &["config", "check"]).status.code(), Some(0));
    let gone = wag(&dir.path().join("gone"), &["config", "check"]);
    assert_eq!(gone.status.code(), Some(2), "{gone:?}");
}
