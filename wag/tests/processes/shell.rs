//! `wag` as its users start it, the arm it drives, and what it recorded.

use crate::support::command;
use arm_model::joint::START_POSE;
use shared_types::ipc::{CauseRecord, CycleRecord};
use std::path::Path;
use std::process::Command;
use xarm_sim::{ArmConfig, SimulatedArm};

/// An arm in this process, at the start pose.
pub(crate) fn arm() -> SimulatedArm {
    SimulatedArm::start(ArmConfig {
        command_port: 0,
        report_ports: [0; 4],
        initial_q: START_POSE,
        ..ArmConfig::default()
    })
    .unwrap()
}

/// A command such as `wiggle` on that arm, into `run`.
pub(crate) fn on_arm(arm: &SimulatedArm, line: &str, run: &Path) -> Command {
    let [joints, _, rich, _] = arm.ports().reports;
    let ports = format!("--report-port {joints} --status-port {rich}");
    let address = format!("--arm 127.0.0.1 --command-port {}", arm.ports().command);
    let out = run.display();
    command(&format!("{line} --json {address} {ports} --out {out}"))
}

/// Cycles of the last trajectory that was streamed, the last one first.
pub(crate) fn last_flight(cycles: &[CycleRecord]) -> impl Iterator<Item = &CycleRecord> {
    let from_its_end = cycles.iter().rev().skip_while(|c| c.trajectory_s < 0.0);
    from_its_end.take_while(|c| c.trajectory_s >= 0.0)
}

/// Cycles and causes of a run's recording.
pub(crate) fn recorded(run: &Path) -> (Vec<CycleRecord>, Vec<CauseRecord>) {
    let recording = run_log::Run::open(run).unwrap().recording().unwrap();
    let log = recording.log().unwrap();
    assert_eq!(log.flaws, Vec::<String>::new());
    (recording.cycles().unwrap().cycles, log.causes)
}
