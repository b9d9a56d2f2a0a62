//! `wag identify` on films of simulated ropes, from files to files: what it says of ropes
//! inside the ranges and outside.

use super::support::{are_refused_in, calibrate, has, said, wag_in};
use arm_model::Limits;
use arm_model::Pole;
use planner::ropes::{TRIAL_SALT, outside_rope, trial_rope};
use planner::synthetic::{
    FilmTiming, KeypointLayout, Randomisation, film as film_rope, side_camera,
};
use planner::wiggle::{WiggleConfig, wiggle};
use rope_sim::PlannedArm;
use shared_types::RopeParams;
use std::fmt::Write;
use std::path::Path;

/// Seed of ropes and noise.
const SEED: u64 = 71;

/// Films a rope's wiggle into keypoints, joints and camera of `folder`.
fn film(rope: &RopeParams, index: u64, folder: &Path) {
    let config = WiggleConfig::default();
    let motion = wiggle(&config, &Limits::default()).unwrap();
    let camera = side_camera();
    let filmed = film_rope(
        rope,
        &PlannedArm::new(motion, Pole::default()),
        &camera,
        KeypointLayout::Uniform(24),
        &FilmTiming::default(),
        &Randomisation::default().draw(SEED ^ TRIAL_SALT, index),
    )
    .unwrap();
    let keypoints = serde_json::to_string(&filmed.track).unwrap();
    std::fs::write(folder.join("keypoints.json"), keypoints).unwrap();
    calibrate(folder, &camera);
    let mut joints = String::from("t,q1,q2,q3,q4,q5,q6,q7\n");
    for i in 0..2000 {
        let t_s = f64::from(i) * 0.004;
        let q = motion.state_at(t_s.min(motion.duration_s())).q;
        let q: Vec<String> = q.iter().map(|v| format!("{v:.9}")).collect();
        writeln!(joints, "{t_s:.3},{}", q.join(",")).unwrap();
    }
    std::fs::write(folder.join("joints.csv"), joints).unwrap();
}

/// What `wag identify` says, and the rope file it leaves.
fn identified(rope: &RopeParams, index: u64) -> (String, toml::Table) {
    let folder = tempfile::tempdir().unwrap();
    film(rope, index, folder.path());
    let output = wag_in(
        folder.path(),
        "identify --method hybrid --keypoints keypoints.json --camera camera.toml \
         --joints joints.csv --out rope.toml",
    );
    assert!(output.status.success(), "{}", said(&output));
    let file = std::fs::read_to_string(folder.path().join("rope.toml")).unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    (printed, file.parse().unwrap())
}

/// A track that is not to be relied on, and joints that end before the film does.
#[test]
fn films_that_tell_too_little_are_refused_before_any_fit() {
    let folder = tempfile::tempdir().unwrap();
    film(&trial_rope(SEED, 0), 0, folder.path());
    let at = |name: &str| folder.path().join(name);
    let joints = std::fs::read_to_string(at("joints.csv")).unwrap();
    let begin: Vec<&str> = joints.lines().take(51).collect();
    std::fs::write(at("short.csv"), begin.join("\n")).unwrap();
    let command = "identify --keypoints keypoints.json --camera camera.toml --out rope.toml";
    let case = format!("{command} --joints short.csv => short.csv | the film lasts");
    are_refused_in(folder.path(), 2, &case);
    let track = std::fs::read_to_string(at("keypoints.json")).unwrap();
    let mut track: serde_json::Value = serde_json::from_str(&track).unwrap();
    track["unconfirmed"] = serde_json::json!(["the rope's end is not confirmed"]);
    std::fs::write(at("keypoints.json"), track.to_string()).unwrap();
    let case = format!(
        "{command} --joints joints.csv => the rope's end is not confirmed | --accept-unconfirmed"
    );
    are_refused_in(folder.path(), 1, &case);
    assert!(!at("rope.toml").exists());
}

#[test]
fn a_rope_of_the_ranges_is_taken_for_one() {
    let rope = trial_rope(SEED, 0);
    let (said, file) = identified(&rope, 0);
    assert!(!said.contains("outside"), "{said}");
    assert!(!said.contains("wide"), "{said}");
    assert_eq!(file["fit"]["method"].as_str(), Some("hybrid-network"));
    assert_eq!(file["fit"]["out_of_distribution"].as_bool(), Some(false));
    let off_m = file["length_m"].as_float().unwrap() - rope.length_m;
    assert!(off_m.abs() < 0.01, "{off_m}");
}

/// A chain, a long, a short and a stiff rope (with `WAG_LONG_TESTS=1`; else a chain and a
/// long one) are fitted by the search that knows no ranges, and it is said.
#[test]
fn ropes_outside_are_fitted_wide_and_it_is_said() {
    let kinds: &[u64] = match std::env::var_os("WAG_LONG_TESTS") {
        Some(_) => &[0, 1, 3, 5],
        None => &[0, 1],
    };
    for kind in kinds {
        let rope = outside_rope(SEED, *kind);
        let (said, file) = identified(&rope, *kind);
        println!("{kind}: {said}");
        has(&said, &["outside the known ranges"]);
        has(&said, &["by a search without ranges"]);
        let fit = &file["fit"];
        assert_eq!(fit["method"].as_str(), Some("hybrid-wide"), "{kind}");
        assert_eq!(fit["out_of_distribution"].as_bool(), Some(true));
        if *kind != 0 {
            // Ropes of the known link counts move as the model can.
            let off_m = file["length_m"].as_float().unwrap() - rope.length_m;
            assert!(off_m.abs() < 0.02, "{kind}: {off_m}");
        }
    }
}
