//! `wag run --fast`: strikes out of the swing that a short wiggle leaves, and what becomes of those
//! that are not worth it.

use super::support::{Rig, alone, command, ended, has, heard, moved_in, refused_in, said, wag_in};
use run_log::files;
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::process::Stdio;

/// A rig that films, its arm and camera as arguments, and the camera's domain.
fn filmed(name: &str, rope: &str) -> (Rig, String, String) {
    let domain = format!("{name}{}", std::process::id());
    let rig = Rig::start(&format!("--rope {rope} --seed 4 --camera {domain}"));
    let [port, joints, _, rich, _] = rig.ports();
    let arm = format!(
        "--arm 127.0.0.1 --command-port {port} --report-port {joints} --status-port {rich} --camera {domain}"
    );
    (rig, arm, domain)
}

/// Wiggled where the throw starts, not calmed, thrown when the swing has come to where it was
/// planned for; no other throw begins so.
#[test]
fn a_strike_out_of_the_swing_is_thrown_at_its_instant_and_at_no_other() {
    let _turn = alone();
    let (_rig, arm, domain) = filmed("fast", "random");
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let done = moved_in(here, &format!("run --fast {arm} --seed 4"), "fast");
    assert_eq!(
        (&done["settle"], &done["warnings"]),
        (&Value::Null, &json!([]))
    );
    let missed_m = done["true_tip_target_distance_m"].as_f64().unwrap();
    assert!(missed_m < 0.02, "{missed_m} m");
    assert!(
        done["throw_late_s"].as_f64().unwrap().abs() < 0.02,
        "{done}"
    );
    assert_eq!(done["wiggle"]["frames"], 204);
    let plan = files::read_plan(&here.join("fast/plan.json")).unwrap();
    let state = plan.start.as_ref().unwrap();
    assert_eq!(state.check(plan.rope.links), Ok(()));
    assert!(here.join("fast/report.html").exists());
    for again in ["--again fast", "--from throw fast"] {
        let refused = refused_in(here, 2, &format!("run {again} {arm} --out other"));
        assert!(refused.contains("still swung"), "{refused}");
    }
    let line = format!(
        "throw fast/plan.json {}",
        arm.replace(&format!(" --camera {domain}"), "")
    );
    let refused = refused_in(here, 2, &line);
    assert!(refused.contains("still swung"), "{refused}");
    has(
        &said(&wag_in(here, "check fast/plan.json")),
        &["still swung"],
    );
    // Its rope is known now, and struck with from rest.
    let calm = moved_in(here, &format!("run --from plan fast {arm}"), "calm");
    assert!(
        calm["true_tip_target_distance_m"].as_f64().unwrap() < 0.02,
        "{calm}"
    );
    assert_eq!(calm["throw_late_s"], Value::Null);
}

/// Runs a command that asks, types each word that it wants, and leaves the rest to it; the words.
fn confirmed(line: &str) -> Vec<String> {
    let mut child = command(line).stdin(Stdio::piped()).spawn().unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let mut words = Vec::new();
    let said = loop {
        if let Err(said) = heard(&mut child, "type ") {
            break said;
        }
        let word = heard(&mut child, " ").unwrap();
        writeln!(stdin, "{}", word.trim()).unwrap();
        words.push(word.trim().to_owned());
    };
    has(&format!("{}{said}", ended(child, 0)), &["run folder"]);
    words
}

/// For a real arm, too: what somebody confirms is an arm that stands, and the plan comes after.
#[test]
fn a_strike_out_of_the_swing_is_confirmed_where_it_begins() {
    let _turn = alone();
    let (_rig, arm, _) = filmed("asked", "random");
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let line = format!(
        "run --fast {arm} --seed 4 --ask --yes --operator Ada --out {}",
        run.display()
    );
    let words = confirmed(&line);
    let summary: Value = files::read_json(&run.join(files::SUMMARY)).unwrap();
    // On a busy machine it is calmed, and asked for once more.
    let asked = if summary["settle"].is_null() {
        &["WIGGLE", "THROW"][..]
    } else {
        &["WIGGLE", "THROW", "MOVE", "THROW"]
    };
    assert_eq!(words, asked, "{summary:#}");
    let missed_m = summary["true_tip_target_distance_m"].as_f64().unwrap();
    assert!(missed_m < 0.02, "{summary:#}");
}

/// A tape that lies by a fifth stands for what no rope of the model does: the short film is not
/// relied on, and the rope is calmed before its throw.
#[test]
fn a_rope_that_the_short_wiggle_does_not_tell_is_wiggled_at_length() {
    let _turn = alone();
    let folder = tempfile::tempdir().unwrap();
    // Its swing decays within seconds.
    let rope = folder.path().join("rope.toml");
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../configs/rope/example.toml");
    let example = fs::read_to_string(example).unwrap();
    fs::write(&rope, example.replace("0.00707", "0.04")).unwrap();
    let (_rig, arm, _) = filmed("again", &rope.display().to_string());
    let run = folder.path().join("run");
    let line = format!(
        "run --fast {arm} --seed 4 --length 0.42 --ask --yes --operator Ada --out {}",
        run.display()
    );
    let words = confirmed(&line);
    assert_eq!(words, ["WIGGLE", "MOVE", "WIGGLE", "MOVE", "THROW"]);
    let done: Value = files::read_json(&run.join(files::SUMMARY)).unwrap();
    has(
        done["warnings"][0].as_str().unwrap(),
        &["wiggled again, at length"],
    );
    assert_eq!(done["wiggle"]["frames"], 400);
    assert!(
        done["settle"].is_object() && done["throw_late_s"].is_null(),
        "{done:#}"
    );
    let plan = files::read_plan(&run.join(files::PLAN)).unwrap();
    assert_eq!(plan.start, None);
}
