//! Killing any process of a demo at a random moment: it is reported within
//! three seconds, nothing is left running, and the next demo succeeds.
#![cfg(test)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const PROCESSES: [&str; 5] = [
    "rig",
    "rt-controller",
    "guardian",
    "camera-ingest",
    "planner",
];

/// Command lines of all running processes: (pid, arguments).
fn running() -> Vec<(u32, Vec<String>)> {
    fs::read_dir("/proc")
        .unwrap()
        .filter_map(|entry| {
            let pid: u32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
            let bytes = fs::read(format!("/proc/{pid}/cmdline")).ok()?;
            let args: Vec<String> = bytes
                .split(|b| *b == 0)
                .map(|a| String::from_utf8_lossy(a).into_owned())
                .collect();
            (args.len() > 1).then_some((pid, args))
        })
        .collect()
}

/// Processes whose command line names this run folder, by process name.
fn of_run(run: &Path) -> Vec<(u32, String)> {
    let run = run.display().to_string();
    running()
        .into_iter()
        .filter(|(_, args)| args.iter().any(|a| a.starts_with(&run)))
        .map(|(pid, args)| {
            let named = args
                .iter()
                .position(|a| a == "process")
                .and_then(|i| args.get(i + 1));
            (pid, named.cloned().unwrap_or_else(|| "wag".to_owned()))
        })
        .collect()
}

fn demo(run: &Path, seed: u64) -> Child {
    Command::new(env!("CARGO_BIN_EXE_wag"))
        .args(["demo", "--json", "--seed", &seed.to_string(), "--out"])
        .arg(run)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn kill_9(pid: u32) {
    let pid = rustix::process::Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).unwrap();
}

/// Waits until the named process runs and some more.
fn wait_for(run: &Path, name: &str, more: Duration) -> u32 {
    let began = Instant::now();
    loop {
        if let Some((pid, _)) = of_run(run).into_iter().find(|(_, n)| n == name) {
            sleep(more);
            return pid;
        }
        assert!(
            began.elapsed() < Duration::from_secs(20),
            "{name} never started"
        );
        sleep(Duration::from_millis(10));
    }
}

fn nothing_left(run: &Path, within: Duration) {
    let began = Instant::now();
    while !of_run(run).is_empty() {
        assert!(began.elapsed() < within, "still running: {:?}", of_run(run));
        sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_killed_process_is_reported_and_nothing_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for (i, victim) in PROCESSES.into_iter().enumerate() {
        let run = folder.path().join(format!("kill-{victim}"));
        let child = demo(&run, 100 + i as u64);
        let moment = Duration::from_millis(rng.random_range(300..16_000));
        let pid = wait_for(&run, victim, moment);
        kill_9(pid);
        let killed = Instant::now();
        let output = child.wait_with_output().unwrap();
        let took = killed.elapsed();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(
            output.status.code(),
            Some(1),
            "{victim} killed after {moment:?}: {said}"
        );
        assert!(
            said.contains(victim),
            "{victim} killed after {moment:?}: {said}"
        );
        assert!(
            took < Duration::from_secs(3),
            "{victim}: reported only after {took:?}"
        );
        nothing_left(&run, Duration::from_millis(100));
        let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert_eq!(told["ok"], false);
    }

    // The supervisor itself: its processes end themselves.
    let run = folder.path().join("kill-wag");
    let mut child = demo(&run, 200);
    wait_for(
        &run,
        "planner",
        Duration::from_millis(rng.random_range(300..8_000)),
    );
    kill_9(child.id());
    child.wait().unwrap();
    nothing_left(&run, Duration::from_secs(3));

    // The next demo succeeds.
    let run = folder.path().join("after");
    let output = demo(&run, 1).wait_with_output().unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["ok"], true);
    assert!(
        told["true_tip_target_distance_m"].as_f64().unwrap() < 0.15,
        "{told:#}"
    );
    for stage in [
        "start_s",
        "bringup_s",
        "wiggle_s",
        "track_s",
        "identify_s",
        "plan_s",
        "throw_s",
        "score_s",
    ] {
        assert!(told["stages"][stage].as_f64().unwrap() > 0.0, "{stage}");
    }
    for file in [
        "summary.json",
        "plan.json",
        "plan.csv",
        "params.toml",
        "keypoints.json",
        "joints.csv",
        "cycles.csv",
        "wiggle.png",
    ] {
        assert!(run.join(file).is_file(), "{file} is missing");
    }
    nothing_left(&run, Duration::from_millis(100));
}
