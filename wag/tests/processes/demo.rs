//! Processes of a whole demo killed while the arm moves.

use super::shell::{process_of, recorded, said, send, until, wag};
use rustix::process::Signal;
use shared_types::ipc::{Bus, ControllerMode, StateReader};
use shared_types::{FaultCode, MotionTier, Plan};
use std::path::Path;
use std::process::Child;
use std::time::Duration;

/// Longest wait for a stage of a demo.
const PATIENCE: Duration = Duration::from_secs(300);

fn demo(run: &Path) -> Child {
    wag(&["demo", "--seed", "4", "--json", "--out"])
        .arg(run)
        .spawn()
        .unwrap()
}

/// Waits until a trajectory of `tier` is streamed; how many seconds on it.
fn wait_for_streaming(run: &Path, tier: MotionTier) {
    let config = run.join("config/rt-controller.toml");
    let domain = until("the controller's configuration", PATIENCE, || {
        let text = std::fs::read_to_string(&config).ok()?;
        let table: toml::Table = toml::from_str(&text).ok()?;
        Some(table.get("domain")?.as_str()?.to_owned())
    });
    let bus = Bus::join(&domain).unwrap();
    let state = until("the controller", PATIENCE, || StateReader::open(&bus).ok());
    until("the motion", PATIENCE, || {
        let now = state.get();
        (now.mode == ControllerMode::Streaming as u8 && now.tier == tier as u8).then_some(())
    });
}

#[test]
fn fault_25_a_planner_killed_while_its_plan_runs_changes_nothing_but_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let run = folder.path().join("run");
    let child = demo(&run);
    wait_for_streaming(&run, MotionTier::Throw);
    std::thread::sleep(Duration::from_millis(300));
    send(process_of(&run, "planner").unwrap(), Signal::KILL);
    let (code, said) = said(child);
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("planner process was killed by signal 9"),
        "{said}"
    );

    // The throw is whole, and to the bit what was planned.
    let plan = std::fs::read_to_string(run.join("plan.json")).unwrap();
    let plan: Plan = serde_json::from_str(&plan).unwrap();
    let (cycles, causes) = recorded(&run);
    let throw: Vec<_> = cycles
        .iter()
        .rev()
        .skip_while(|c| c.trajectory_s < 0.0)
        .take_while(|c| c.trajectory_s >= 0.0)
        .collect();
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
    let run = folder.path().join("run");
    let child = demo(&run);
    wait_for_streaming(&run, MotionTier::Wiggle);
    std::thread::sleep(Duration::from_millis(700));
    send(process_of(&run, "camera-ingest").unwrap(), Signal::KILL);
    let (code, said) = said(child);
    assert_eq!(code, Some(1), "{said}");
    assert!(
        said.contains("camera-ingest process was killed by signal 9"),
        "{said}"
    );
    assert!(!run.join("params.toml").exists(), "nothing was identified");
    let (_, causes) = recorded(&run);
    let met: Vec<_> = causes.iter().map(|c| (c.fault(), c.path)).collect();
    assert_eq!(met, [(FaultCode::OperatorStop, 2)], "braked, within limits");
}
