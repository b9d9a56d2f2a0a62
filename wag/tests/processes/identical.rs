//! A plan is executed identically, byte for byte in the record, with planner and
//! camera killed half-way.

use super::shell::{arm, last_flight, on_arm, recorded};
use crate::support::{Running, alone, command, ended, plan_json, until};
use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector};
use camera_ingest::process::CameraConfig;
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest};
use planner::ropes::random_rope;
use planner::service::{PlannerRequest, PlannerRpc};
use run_log::files::{PLAN, SUMMARY, read_json, read_plan};
use serde_json::{Value, json};
use shared_types::ipc::message::{CameraRequest, CameraRpc};
use shared_types::ipc::rpc::{Rpc, RpcClient};
use shared_types::ipc::{Bus, ControllerMode, CycleRecord, DomainSweep, StateReader};
use shared_types::{FaultCode, MonotonicNs, OperatingMode, Task};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;
use xarm_sim::{ArmEvent, SimulatedArm};

const PATIENCE: Duration = Duration::from_secs(60);
/// Cycles of half the plan.
const HALF_WAY: u64 = 250;

/// A throw of 2 s, from where the arm is held: it reports single precision.
fn plan() -> JointTrajectory {
    let held: JointVector = START_POSE.map(|q| f64::from(q as f32));
    let mut out = held;
    (out[1], out[3], out[5]) = (out[1] + 0.10, out[3] - 0.12, out[5] + 0.45);
    JointTrajectory::new(&[0.0, 1.0, 2.0], &[held, out, held]).unwrap()
}

/// A process of the run in `domain`, as a daemon beside those that `wag` starts.
fn daemon<R: Rpc>(
    bus: &Bus,
    folder: &Path,
    (name, config): (&str, &impl serde::Serialize),
    ping: &R::Request,
) -> (Running, RpcClient<R>) {
    let path = folder.join(format!("{name}.toml"));
    std::fs::write(&path, toml::to_string(config).unwrap()).unwrap();
    let log = std::fs::File::create(folder.join(format!("{name}.log"))).unwrap();
    let mut command = command(&format!("process {name} --config"));
    let process = Running(command.arg(&path).stderr(log).spawn().unwrap());
    let client = RpcClient::<R>::open(bus).unwrap();
    let pending = until("a service", PATIENCE, || client.call(ping).ok());
    until("its answer", PATIENCE, || pending.try_next().unwrap());
    (process, client)
}

/// A plan that is searched for meanwhile.
fn strike() -> PlannerRequest {
    let config = PlannerConfig::default();
    let goal = config.goal(Task::Strike, [0.95, 0.0, 0.2]);
    let options = PlanOptions {
        seed: 1,
        library_candidates: 0,
        ..config.search
    };
    let request = PlanRequest::new(goal, &random_rope(1), options);
    PlannerRequest::Plan(Box::new(request))
}

fn bits(q: &JointVector) -> [u64; 7] {
    core::array::from_fn(|j| q[j].to_bits())
}

/// What a setpoint becomes on the wire.
fn wire_bits(q: &JointVector) -> [u32; 7] {
    core::array::from_fn(|j| (q[j] as f32).to_bits())
}

/// What is compared: everything a cycle commanded, on the plan's own clock. What
/// was measured, and when, is the machine's and the arm's.
fn commanded(record: &CycleRecord) -> Vec<u8> {
    let of_the_plan = CycleRecord {
        cycle: 0,
        missed: 0,
        deadline_ns: 0,
        wake_late_ns: 0,
        compute_ns: 0,
        send_ns: 0,
        reply_ns: 0,
        q: JointVector::ZERO,
        q_stamp_ns: 0,
        ..*record
    };
    postcard::to_allocvec(&of_the_plan).unwrap()
}

/// What reached the arm while it was at it.
fn arrived(arm: &SimulatedArm, from: MonotonicNs) -> BTreeSet<[u32; 7]> {
    let events = arm.events().since(from);
    let setpoints = events.iter().filter_map(|e| match &e.event {
        ArmEvent::Setpoint(q) => Some(wire_bits(q)),
        _ => None,
    });
    setpoints.collect()
}

/// One throw of the plan while planner and camera are at work; with `murder`, both are
/// killed half-way. Its cycles that sent a setpoint.
fn throw(folder: &Path, name: &str, murder: bool) -> Vec<CycleRecord> {
    let folder = folder.join(name);
    std::fs::create_dir(&folder).unwrap();
    let file = folder.join("plan.json");
    std::fs::write(&file, plan_json(&plan(), &random_rope(1)).to_string()).unwrap();
    let (arm, run) = (arm(), folder.join("run"));
    let line = format!("throw {}", file.display());
    let mut child = on_arm(&arm, &line, &run);
    let mut child = child.env("WAG_LOG", "info").spawn().unwrap();
    let domain = format!("run-{}", child.id());
    let _sweep = DomainSweep::new(&domain);
    let bus = Bus::join(&domain).unwrap();
    let camera = CameraConfig {
        domain: domain.clone(),
    };
    let config = PlannerConfig {
        domain,
        ..PlannerConfig::default()
    };
    let ping = CameraRequest::Ping;
    let (mut camera, films) = daemon::<CameraRpc>(&bus, &folder, ("camera-ingest", &camera), &ping);
    let ping = PlannerRequest::Ping;
    let (mut planner, plans) = daemon::<PlannerRpc>(&bus, &folder, ("planner", &config), &ping);
    let planned = plans.call(&strike()).unwrap();
    let began = xarm_sim::clock::now();
    let state = until("the controller", PATIENCE, || StateReader::open(&bus).ok());
    let streams = until("the throw", PATIENCE, || {
        let over = child.try_wait().unwrap();
        assert_eq!(over, None, "ended before its throw");
        let now = state.get();
        let is_throw = now.operating_mode == OperatingMode::Throw as u8;
        (is_throw && now.mode == ControllerMode::Streaming as u8).then_some(now.cycle)
    });
    let film = CameraRequest::Record {
        frames: 10_000,
        both_images: true,
    };
    let filmed = films.call(&film).unwrap();
    if murder {
        until("half of the throw", PATIENCE, || {
            (state.get().cycle > streams + HALF_WAY).then_some(())
        });
        assert_eq!(state.get().mode, ControllerMode::Streaming as u8);
        camera.kill();
        planner.kill();
    }
    ended(child, 0);
    let dead = planner.0.try_wait().unwrap().is_some();
    assert_eq!(dead, murder, "killed while the arm moved, or never");
    drop((planned, filmed));
    let (cycles, causes) = recorded(&run);
    // Its end at rest is a stop, too.
    let met: Vec<_> = causes.iter().map(|c| (c.fault(), c.motion_id)).collect();
    assert_eq!(met, [(FaultCode::OperatorStop, 0)]);
    // What it was for is kept with it.
    let kept = read_plan(&run.join(PLAN)).unwrap();
    assert_eq!(kept.trajectory, plan());
    let summary: Value = read_json(&run.join(SUMMARY)).unwrap();
    let told = ["command", "task"].map(|key| summary[key].as_str().unwrap_or_default());
    assert_eq!(told, ["throw", "strike"], "{summary}");
    assert_eq!(summary["target_m"], json!(kept.target_m));
    let guardian = std::fs::read_to_string(run.join("log/guardian.log")).unwrap();
    assert!(guardian.contains("guarding the controller"), "{guardian}");
    let sent = last_flight(&cycles).filter(|r| r.sent != 0);
    let mut flown: Vec<_> = sent.copied().collect();
    flown.reverse();
    // One that the loop was held up with is held back, by design.
    let went = flown.iter().filter(|r| r.send_ns > 0);
    let sent: BTreeSet<_> = went.map(|r| wire_bits(&r.q_c)).collect();
    let missing = sent.difference(&arrived(&arm, began)).count();
    assert_eq!(missing, 0, "setpoints that never reached the arm");
    flown
}

/// Each setpoint is the plan at its instant, to the bit. A machine that is late
/// sends some for other instants than the planned ones, none for another plan.
fn is_the_plan(flown: &[CycleRecord]) {
    let plan = plan();
    for record in flown {
        let (t_s, planned) = (record.trajectory_s, plan.state_at(record.trajectory_s).q);
        assert_eq!(bits(&record.q_c), bits(&planned), "at {t_s} s");
        // Behind its end it is followed no more.
        let rate = f64::from(t_s < plan.duration_s());
        assert_eq!(record.speed_override.to_bits(), rate.to_bits());
    }
    let end_s = flown.last().unwrap().trajectory_s;
    assert!(end_s >= plan.duration_s(), "ended at {end_s} s");
}

#[test]
fn a_plan_runs_byte_for_byte_the_same_with_planner_and_camera_killed_half_way() {
    let _alone = alone();
    let folder = tempfile::tempdir().unwrap();
    let quiet = throw(folder.path(), "quiet", false);
    let killed = throw(folder.path(), "killed", true);
    is_the_plan(&quiet);
    is_the_plan(&killed);
    // Cycles for one instant of the plan have the same record, byte for byte.
    let of = |r: &CycleRecord| (r.trajectory_s.to_bits(), commanded(r));
    let by_instant: BTreeMap<u64, Vec<u8>> = quiet.iter().map(of).collect();
    let mut same = 0;
    for record in &killed {
        if let Some(bytes) = by_instant.get(&record.trajectory_s.to_bits()) {
            let t_s = record.trajectory_s;
            assert_eq!(bytes, &commanded(record), "at {t_s} s");
            same += 1;
        }
    }
    let [quiet, killed] = [quiet.len(), killed.len()];
    println!("{same} cycles at the same instants of {quiet} and {killed}");
    assert!(same > 20, "{same}: this machine is late in every cycle");
}
