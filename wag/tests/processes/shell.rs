//! `wag` as its users start it, the arm it drives, and what it recorded.

use crate::support::command;
use arm_model::joint::START_POSE;
use rt_controller::recording::{Item, LogReader, Read};
use shared_types::ipc::{CauseRecord, CycleRecord};
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};
use xarm_sim::{ArmConfig, SimulatedArm};

/// An arm in this process, at the start pose.
pub fn arm() -> SimulatedArm {
    SimulatedArm::start(ArmConfig {
        command_port: 0,
        report_ports: [0; 4],
        initial_q: START_POSE,
        ..ArmConfig::default()
    })
    .unwrap()
}

/// `wag wiggle` on that arm, into `run`.
pub fn wiggle(arm: &SimulatedArm, run: &Path, more: &[&str]) -> Command {
    let [joints, _, rich, _] = arm.ports().reports;
    let mut command = command(&["wiggle", "--arm", "127.0.0.1", "--json"]);
    command
        .args(["--command-port", &arm.ports().command.to_string()])
        .args(["--report-port", &joints.to_string()])
        .args(["--status-port", &rich.to_string()])
        .args(more)
        .arg("--out")
        .arg(run);
    command
}

pub fn send(pid: u32, signal: rustix::process::Signal) {
    let pid = rustix::process::Pid::from_raw(i32::try_from(pid).unwrap()).unwrap();
    rustix::process::kill_process(pid, signal).unwrap();
}

/// Process of a run by its name, `None` while it is not there.
pub fn process_of(run: &Path, name: &str) -> Option<u32> {
    let run = run.display().to_string();
    std::fs::read_dir("/proc").unwrap().find_map(|entry| {
        let pid: u32 = entry.ok()?.file_name().to_str()?.parse().ok()?;
        let line = std::fs::read(format!("/proc/{pid}/cmdline")).ok()?;
        let args: Vec<_> = line
            .split(|b| *b == 0)
            .map(String::from_utf8_lossy)
            .collect();
        let is_it = args
            .windows(2)
            .any(|pair| pair[0] == "process" && pair[1] == name);
        (is_it && args.iter().any(|a| a.starts_with(&run))).then_some(pid)
    })
}

pub fn until<T>(what: &str, within: Duration, mut look: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(began.elapsed() < within, "{what} never came");
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// What a child said, once it has ended; its exit code.
pub fn said(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().unwrap();
    let text = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    (output.status.code(), text)
}

/// Cycles and causes of a run's recording.
pub fn recorded(run: &Path) -> (Vec<CycleRecord>, Vec<CauseRecord>) {
    read(&std::fs::read(run.join("cycles.bin")).unwrap())
}

/// Cycles and causes of a recording.
pub fn read(bytes: &[u8]) -> (Vec<CycleRecord>, Vec<CauseRecord>) {
    let (mut cycles, mut causes) = (Vec::new(), Vec::new());
    for read in LogReader::open(bytes).unwrap() {
        match read {
            Read::Item(Item::Cycle(cycle)) => cycles.push(cycle.record),
            Read::Item(Item::Cause(cause)) => causes.push(*cause),
            Read::Item(Item::Keyframe(_) | Item::Motion { .. }) => {}
            Read::Flaw(flaw) => panic!("{flaw}"),
        }
    }
    (cycles, causes)
}
