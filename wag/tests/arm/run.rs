//! `wag run` with an arm and a camera that it did not start: a rig in another process.

use super::support::{Rig, alone, json_in, moved_in, refused_in};
use run_log::{Run, files};
use serde_json::{Value, json};
use std::fs;

#[test]
fn a_rope_is_wiggled_identified_and_thrown_with_an_arm_and_a_camera_that_are_there() {
    let _turn = alone();
    let domain = format!("run{}", std::process::id());
    let rig = Rig::start(&format!("--rope random --seed 31 --camera {domain}"));
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let arm_of = |rig: &Rig| {
        let [port, joints, _, rich, _] = rig.ports();
        format!("--arm 127.0.0.1 --command-port {port} --report-port {joints} --status-port {rich}")
    };
    let arm = arm_of(&rig);
    // Nothing moves, and nothing stays, where nobody films.
    let nobody = refused_in(here, 2, &format!("run {arm} --camera {domain}x --out none"));
    assert!(
        nobody.contains("no simulated rig films in domain"),
        "{nobody}"
    );
    assert!(!here.join("none").exists());

    let strike = format!("run strike {arm} --camera {domain} --keep-films");
    let done = moved_in(here, &strike, "run");
    let missed_m = done["true_tip_target_distance_m"].as_f64().unwrap();
    assert!(missed_m < 0.02, "{missed_m} m");
    assert_eq!(done["command"], "run");
    assert_eq!(done["bring_up"][0]["step"], "identify");
    // The truth is compared with and never used: the rope is the film's, whoever asks again.
    let run = here.join("run");
    assert!(run.join(files::PLAN).exists() && run.join(files::CAMERA).exists());
    let again = json_in(here, "identify --keypoints run --out again.toml");
    let length_m = |value: &serde_json::Value| value["length_m"].as_f64().unwrap();
    let (first, second) = (
        length_m(&done["identified"]["params"]),
        length_m(&again["rope"]),
    );
    assert!((first - second).abs() < 5e-3, "{first} and {second} m");

    // The films are kept whole: the throw is measured again from its own, and gives the same;
    // the wiggle's is tracked again with the joints of the run, which count from its first frame.
    let score = json_in(here, "score --run run");
    let closest_m = |score: &Value| score["closest_m"].as_f64().unwrap();
    assert!((closest_m(&score) - closest_m(&done["score"])).abs() < 1e-6);
    json_in(here, "export csv run");
    let track = "track --video run/wiggle_1344x376.yuyv --camera run/camera.toml --joints run/joints.csv --out again.json";
    assert_eq!(json_in(here, track)["frames"], 400);
    let retracked = json_in(
        here,
        "identify --keypoints again.json --camera run/camera.toml --joints run/joints.csv --out fourth.toml",
    );
    let fourth = length_m(&retracked["rope"]);
    assert!((first - fourth).abs() < 2e-3, "{first} and {fourth} m");

    // A wiggle by itself films too, and all after it begins from its folder. The rope of this rig
    // swings for minutes now, the same one of another hangs still.
    drop(rig);
    let domain = format!("{domain}b");
    let rig = Rig::start(&format!("--rope random --seed 31 --camera {domain}"));
    let arm = arm_of(&rig);
    let wiggle = format!("wiggle {arm} --camera {domain}");
    moved_in(here, &wiggle, "alone");
    let tracked = json_in(here, "identify --keypoints alone --out third.toml");
    let third = length_m(&tracked["rope"]);
    assert!((first - third).abs() < 2e-2, "{first} and {third} m");

    // Its throw, and what the first run has found is gone on with from every stage.
    let thrown = |from: &str, out: &str| {
        let line = format!("run {from} {arm} --camera {domain}");
        let done = moved_in(here, &line, out);
        let missed_m = done["true_tip_target_distance_m"].as_f64().unwrap();
        assert!(missed_m < 0.02, "{line}: {missed_m} m");
        done
    };
    thrown("--from identify alone --target 0.85,0.1,0.3", "a");
    let moved = thrown("--from plan run --target 0.8,-0.15,0.35", "b");
    assert_eq!(moved["target_m"], json!([0.8, -0.15, 0.35]));
    assert_eq!(moved["identified"], Value::Null, "the rope was known");
    let plan = |run: &str| fs::read(here.join(run).join(files::PLAN)).unwrap();
    thrown("--from throw run", "c");
    assert_eq!(plan("c"), plan("run"));
    let corrected = thrown("--again run", "d");
    assert_eq!(corrected["target_m"], done["target_m"]);
    assert_ne!(plan("d"), plan("run"));
}

/// The rig puts board and domino up; what the tip does to them is judged by camera and truth alike.
#[test]
fn a_lob_is_thrown_with_an_arm_and_a_camera_that_are_there_and_judged_as_it_is() {
    let _turn = alone();
    let domain = format!("lob{}", std::process::id());
    let rig = Rig::start(&format!(
        "--rope random --seed 41 --camera {domain} --task lob"
    ));
    let [port, joints, _, rich, _] = rig.ports();
    let folder = tempfile::tempdir().unwrap();
    let done = moved_in(
        folder.path(),
        &format!(
            "run lob --arm 127.0.0.1 --command-port {port} --report-port {joints} --status-port {rich} --camera {domain} --keep-films"
        ),
        "run",
    );
    let [seen, true_] = [&done["camera_verdict"], &done["true_verdict"]];
    assert_eq!(true_["success"], true, "{true_}");
    assert_eq!(seen["success"], true, "{seen} {}", done["score_failed"]);
    assert_eq!(seen["conditions"], true_["conditions"]);
    // Judged again by its film, it is the same; by another's, nothing is kept.
    let again = json_in(folder.path(), "score --run run");
    assert_eq!(&again["camera_verdict"], seen);
    assert_eq!(&again["replaced_verdict"], seen);
    let other = "score --run run --video run/wiggle_1344x376.yuyv";
    let refused = refused_in(folder.path(), 1, other);
    assert!(refused.contains("is it this throw's film"), "{refused}");
    let summary = Run::open(&folder.path().join("run")).unwrap().summary();
    let kept = summary.unwrap().unwrap();
    assert_eq!([&kept["camera_verdict"], &kept["score_of_run"]], [seen; 2]);
    assert_eq!(kept["scored_by"]["target_rgb"], done["target_rgb"]);
}

/// The wall is put up, the rope thrown over it, filmed, and judged by camera and truth alike.
#[test]
fn a_drape_is_thrown_and_judged_by_the_camera_as_it_is() {
    let _turn = alone();
    let folder = tempfile::tempdir().unwrap();
    let done = moved_in(
        folder.path(),
        "demo --task drape --seed 41 --target 0.74,-0.1,0.28",
        "run",
    );
    assert_eq!(done["task"], "drape");
    let [seen, true_] = [&done["camera_verdict"], &done["true_verdict"]];
    assert_eq!(seen["success"], true, "{seen} {}", done["score_failed"]);
    assert_eq!(true_["success"], true, "{true_}");
    let names = |verdict: &serde_json::Value| verdict["conditions"].clone();
    assert_eq!(names(seen), names(true_));
    let middle_m = done["true_tip_target_distance_m"].as_f64().unwrap();
    assert!(middle_m < 0.05, "{middle_m} m");
}
