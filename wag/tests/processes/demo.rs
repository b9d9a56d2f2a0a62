//! Processes of a whole demo killed while the arm moves.

use super::shell::{last_flight, recorded};
use crate::support::{alone, command, ended, has, process_of, send, too_busy, until};
use rustix::process::Signal;
use shared_types::ipc::{Bus, ControllerMode, StateReader};
use shared_types::{FaultCode, OperatingMode, Plan};
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::Duration;
use viewer::live::domain_of_run;

/// Longest wait for a stage of a demo.
const PATIENCE: Duration = Duration::from_secs(300);

/// Kills a process of the demo in `run` after some time of its motion; the demo ends with
/// an error that says so.
fn killed(child: Child, run: &Path, victim: &str, after_ms: u64) {
    std::thread::sleep(Duration::from_millis(after_ms));
    let victim_pid = process_of(&run.display().to_string(), victim).unwrap();
    send(victim_pid, Signal::KILL);
    let death = format!("{victim} process was killed by signal 9");
    has(&ended(child, 1), &[&death]);
}

/// A demo that streams a trajectory of `operating_mode` right now, and its folder in `into`.
///
/// One that gave up before because the machine was too busy is begun again, twice;
/// any other that ended has failed, and says why.
fn demo_in(into: &Path, operating_mode: OperatingMode) -> (Child, PathBuf) {
    for attempt in 0..3 {
        let run = into.join(format!("run-{attempt}"));
        let line = format!("demo --seed 4 --json --out {}", run.display());
        let mut child = command(&line).spawn().unwrap();
        if streams(&mut child, &run, operating_mode) {
            return (child, run);
        }
        let said = ended(child, 1);
        assert!(
            too_busy(&said),
            "it ended before its {operating_mode:?}: {said}"
        );
    }
    panic!("three demos found the machine too busy");
}

/// Waits until the demo `child` streams a trajectory of `operating_mode`; `false` when it
/// ended before.
fn streams(child: &mut Child, run: &Path, operating_mode: OperatingMode) -> bool {
    let mut state: Option<StateReader> = None;
    until("the motion", PATIENCE, || {
        if state.is_none() {
            state = domain_of_run(run)
                .ok()
                .and_then(|domain| Bus::join(&domain).ok())
                .and_then(|bus| StateReader::open(&bus).ok());
        }
        let now = state.as_ref().map(StateReader::get);
        let streams = now.is_some_and(|now| {
            now.mode == ControllerMode::Streaming as u8
                && now.operating_mode == operating_mode as u8
        });
        let mut ended = || child.try_wait().unwrap().is_some();
        (streams || ended()).then_some(streams)
    })
}

#[test]
fn fault_25_a_planner_killed_while_its_plan_runs_changes_nothing_but_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let _alone = alone();
    let (child, run) = demo_in(folder.path(), OperatingMode::Throw);
    killed(child, &run, "planner", 300);

    // The throw is whole, and to the bit what was planned.
    let plan = std::fs::read_to_string(run.join("plan.json")).unwrap();
    let plan: Plan = serde_json::from_str(&plan).unwrap();
    let (cycles, causes) = recorded(&run);
    let throw: Vec<_> = last_flight(&cycles).collect();
    let last_s = throw[0].trajectory_s;
    assert!(last_s > plan.trajectory.duration_s() - 0.005, "{last_s} s");
    for cycle in throw.iter().filter(|c| c.sent != 0) {
        assert_eq!(cycle.q_c, plan.trajectory.state_at(cycle.trajectory_s).q);
    }
    // What ends a demo that failed comes after it, at rest.
    let during = causes.iter().filter(|c| c.motion_id != 0).count();
    assert_eq!(during, 0, "{causes:?}");
}

#[test]
fn fault_27_a_camera_killed_during_the_wiggle_ends_it_gently_and_nothing_is_identified() {
    let folder = tempfile::tempdir().unwrap();
    let _alone = alone();
    let (child, run) = demo_in(folder.path(), OperatingMode::Wiggle);
    killed(child, &run, "camera-ingest", 700);
    assert!(!run.join("params.toml").exists(), "nothing was identified");
    let (_, causes) = recorded(&run);
    let met: Vec<_> = causes.iter().map(|c| (c.fault(), c.path)).collect();
    assert_eq!(met, [(FaultCode::OperatorStop, 2)], "braked, within limits");
}
