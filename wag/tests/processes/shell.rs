//! `wag` as its users start it, the arm it drives, and what it recorded.

use crate::support::command;
use arm_model::joint::START_POSE;
use rt_controller::recording::{Item, LogReader, Read};
use shared_types::ipc::{CauseRecord, CycleRecord};
use std::path::Path;
use std::process::{Child, Command};
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

/// What a child said, once it has ended; its exit code.
pub(crate) fn said(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().unwrap();
    let text = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    (output.status.code(), text)
}

/// Cycles and causes of a run's recording.
pub(crate) fn recorded(run: &Path) -> (Vec<CycleRecord>, Vec<CauseRecord>) {
    let recording = run_log::Run::open(run).unwrap().recording().unwrap();
    let (mut cycles, mut causes) = (Vec::new(), Vec::new());
    for read in LogReader::open(recording.bytes()).unwrap() {
        match read {
            Read::Item(Item::Cycle(cycle)) => cycles.push(cycle.record),
            Read::Item(Item::Cause(cause)) => causes.push(*cause),
            Read::Item(Item::Keyframe(_) | Item::Motion { .. }) => {}
            Read::Flaw(flaw) => panic!("{flaw}"),
        }
    }
    (cycles, causes)
}
