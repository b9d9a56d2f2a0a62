//! Killing any process of a demo at a random moment: it is reported within
//! three seconds, nothing is left running, and the next demo succeeds.

use crate::support::{
    alone, command, json_in, moved_in, process_of, processes_of, said, send, until,
};
use arm_model::Limits;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use run_log::{Run, ScoredBy};
use rustix::process::Signal;
use shared_types::ipc::message::ScoreResult;
use std::path::Path;
use std::process::Child;
use std::thread::sleep;
use std::time::{Duration, Instant};

const PROCESSES: &str = "rig rt-controller guardian camera-ingest planner";

fn demo(run: &Path, seed: u64) -> Child {
    let line = format!("demo --json --seed {seed} --out {}", run.display());
    command(&line).spawn().unwrap()
}

/// Waits until the named process runs and some more.
fn wait_for(run: &Path, name: &str, more: Duration) -> u32 {
    let run = run.display().to_string();
    let pid = until(name, Duration::from_secs(20), || process_of(&run, name));
    sleep(more);
    pid
}

fn nothing_left(run: &Path, within: Duration) {
    let run = run.display().to_string();
    until("the end of all processes", within, || {
        processes_of(&run).is_empty().then_some(())
    });
}

/// How many cycles the recording of a run has, without a gap.
fn cycles_of(run: &Path) -> usize {
    let log = Run::open(run)
        .and_then(|run| run.recording()?.log())
        .unwrap();
    assert_eq!(log.flaws, Vec::<String>::new(), "{}", run.display());
    log.samples.len()
}

/// Kills each process of a demo of its own; who was killed when, and the cycles that were recorded.
fn each_killed(folder: &Path, rng: &mut ChaCha8Rng) -> Vec<(&'static str, Duration, usize)> {
    let mut cycles = Vec::new();
    for (i, victim) in PROCESSES.split(' ').enumerate() {
        let run = folder.join(format!("kill-{victim}"));
        let child = demo(&run, 100 + i as u64);
        let moment = Duration::from_millis(rng.random_range(300..16_000));
        let pid = wait_for(&run, victim, moment);
        send(pid, Signal::KILL);
        let killed = Instant::now();
        let output = child.wait_with_output().unwrap();
        let took = killed.elapsed();
        let said = format!("{victim} killed after {moment:?}: {}", said(&output));
        assert_eq!(output.status.code(), Some(1), "{said}");
        assert!(said.matches(victim).count() > 1, "{said}");
        let in_time = took < Duration::from_secs(3);
        assert!(in_time, "reported after {took:?}: {said}");
        nothing_left(&run, Duration::from_millis(100));
        let reported: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(reported["ok"], false);
        cycles.push((victim, moment, cycles_of(&run)));
    }
    cycles
}

#[test]
fn a_killed_process_is_reported_and_nothing_is_left() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut cycles = each_killed(folder.path(), &mut rng);

    // The supervisor itself: its processes end themselves.
    let run = folder.path().join("kill-wag");
    let mut child = demo(&run, 200);
    let moment = Duration::from_millis(rng.random_range(300..8_000));
    wait_for(&run, "planner", moment);
    send(child.id(), Signal::KILL);
    child.wait().unwrap();
    // The recorder outlives the brake by two seconds.
    nothing_left(&run, Duration::from_secs(6));
    cycles.push(("wag", moment, cycles_of(&run)));
    // Most were killed when there was something to lose.
    println!("{cycles:?}");
    assert!(
        cycles.iter().filter(|(.., n)| *n > 250).count() > 3,
        "{cycles:?}"
    );

    // The next demo succeeds.
    let run = folder.path().join("after");
    let reported = moved_in(folder.path(), "demo --seed 1", &run.display().to_string());
    assert_eq!(reported["ok"], true);
    let distance_m = reported["true_tip_target_distance_m"].as_f64().unwrap();
    assert!(distance_m < 0.02, "{reported:#}");
    for stage in "start bringup wiggle track identify plan throw score".split(' ') {
        let time_s = reported["stages"][format!("{stage}_s")].as_f64().unwrap();
        assert!(time_s > 0.0, "{stage}");
    }
    let files = "summary.json plan.json plan.csv params.toml keypoints.json run.mcap wiggle.png";
    for file in files.split(' ') {
        assert!(run.join(file).is_file(), "{file} is missing");
    }
    nothing_left(&run, Duration::from_millis(100));

    // Its next throw aims as far on the other side of the target.
    let score = &reported["score"];
    let again = json_in(folder.path(), "plan again after --out again.json");
    assert_eq!(again["miss_m"], score["miss_m"], "{score}");
    let at = |value: &serde_json::Value, axis: usize| value[axis].as_f64().unwrap();
    let square = |axis| at(&score["miss_m"], axis).powi(2);
    let miss_m = (0..3).map(square).sum::<f64>().sqrt();
    assert!((miss_m - score["closest_m"].as_f64().unwrap()).abs() < 1e-9);
    for axis in 0..3 {
        let aside_m = at(&again["target_m"], axis) - at(&again["aim"]["point_m"], axis);
        assert!(
            (aside_m - at(&again["miss_m"], axis)).abs() < 1e-12,
            "{again}"
        );
    }
    assert!(
        again["predicted_error_m"].as_f64().unwrap() < 1e-3,
        "{again}"
    );
    let plan_in = |name: &str| run_log::files::read_plan(&folder.path().join(name)).unwrap();
    let corrected = plan_in("again.json");
    assert!(
        Limits::default()
            .worst_violation(&corrected.trajectory)
            .is_none()
    );

    // An arm alone would make it, and the same rig does.
    let dry = json_in(folder.path(), "throw --again after --dry-run");
    assert_eq!(dry["ok"], true, "{dry}");
    let second = moved_in(folder.path(), "demo --again after", "second");
    assert_eq!(second["seed"], 1, "{second}");
    assert_eq!(second["target_m"], reported["target_m"]);
    assert_eq!(second["truth"]["rope"], reported["truth"]["rope"]);
    assert_eq!(plan_in("second/plan.json").trajectory, corrected.trajectory);
    let distance_m = second["true_tip_target_distance_m"].as_f64().unwrap();
    assert!(distance_m < 0.015, "{second:#}");
    assert!(second["epoch_ns"].as_u64().unwrap() > 0);
    let run = Run::open(&folder.path().join("second")).unwrap();
    let scored = score_again(&run, corrected.target_m);
    let third = json_in(folder.path(), "plan again second --out third.json");
    assert_eq!(third["miss_m"], serde_json::json!(scored.miss_m), "{third}");
    assert_eq!(third["aim"]["corrections"], 2, "{third}");
}

/// What a camera beside a run measured takes the place of what its own did. Returns that.
fn score_again(run: &Run, target_m: [f64; 3]) -> ScoreResult {
    let scored = ScoreResult {
        closest_m: 0.03,
        interval_m: [0.0, 0.04],
        miss_m: [0.01, -0.02, 0.02],
        time_s: 0.9,
        target_m,
    };
    let elsewhere = ScoreResult {
        target_m: [0.0; 3],
        ..scored
    };
    let own = run.colours().unwrap();
    let by = ScoredBy {
        video: "film.yuyv".into(),
        camera: "camera.toml".into(),
        tip_rgb: [250, 120, 30],
        target_rgb: Some([40, 90, 200]),
    };
    let refused = run.keep_score(&elsewhere, &by).unwrap_err().to_string();
    assert!(refused.contains("another throw"), "{refused}");
    let kept = run.keep_score(&scored, &by).unwrap();
    let own_score = kept.replaced.unwrap();
    assert!(own_score.closest_m < 0.015, "{own_score:?}");
    assert_eq!(kept.warnings, Vec::<String>::new());
    let summary = run.summary().unwrap().unwrap();
    assert_eq!(summary["seed"], 1, "the rest stays");
    // One that contradicts it, by another colour say, is kept with a warning.
    let far_off = ScoreResult {
        closest_m: 0.12,
        interval_m: [0.1, 0.15],
        ..scored
    };
    let again = run.keep_score(&far_off, &by).unwrap();
    assert_eq!(again.replaced, Some(scored));
    assert!(again.warnings[0].contains("contradicts"), "{again:?}");
    assert!(run.keep_score(&scored, &by).is_ok());
    let kept = run.summary().unwrap().unwrap();
    assert_eq!(kept["score_of_run"], serde_json::json!(own_score));
    let mut told = serde_json::json!(by);
    // The last agrees with the run's own.
    told["warnings"] = serde_json::json!([]);
    assert_eq!(kept["scored_by"], told);
    assert_eq!(
        run.colours().unwrap(),
        own,
        "the next score takes the run's"
    );
    assert_eq!(summary["stereo_tip_target_distance_m"], scored.closest_m);
    scored
}
