//! A plan is executed identically, byte for byte in the record, with planner and
//! camera killed half-way.

use super::shell::{arm, read};
use crate::support::{command, send, until};
use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector};
use camera_ingest::process::CameraConfig;
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest};
use planner::service::{PlannerRequest, PlannerRpc};
use rt_controller::ControllerConfig;
use rustix::process::Signal;
use shared_types::ipc::message::{
    CameraRequest, CameraRpc, ControllerEvent, ControllerRequest, ControllerRpc,
};
use shared_types::ipc::rpc::{Pending, Rpc, RpcClient};
use shared_types::ipc::{
    Bus, CauseRecord, ChunkSubscriber, ControllerMode, CycleRecord, DomainSweep, OperatorEnd,
    StateReader,
};
use shared_types::plan::trajectory_hash;
use shared_types::{FaultCode, MonotonicNs, OperatingMode, RopeParams, Task};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Child;
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

/// A process of `wag`; it is killed when dropped.
struct Part(Child);

impl Part {
    fn start<T: serde::Serialize>(folder: &Path, name: &str, config: &T) -> Self {
        let path = folder.join(format!("{name}.toml"));
        std::fs::write(&path, toml::to_string(config).unwrap()).unwrap();
        let log = std::fs::File::create(folder.join(format!("{name}.log"))).unwrap();
        let mut command = command(&format!("process {name} --config"));
        command.arg(&path).env("WAG_LOG", "info").stderr(log);
        Self(command.spawn().unwrap())
    }

    fn kill(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }

    /// Asks it to end in order.
    fn end(&mut self) {
        send(self.0.id(), Signal::TERM);
        self.0.wait().unwrap();
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Cycles of the throw that sent a setpoint.
fn of_the_throw(records: &[CycleRecord]) -> Vec<CycleRecord> {
    let flown = |r: &&CycleRecord| r.trajectory_s >= 0.0 && r.sent != 0;
    records.iter().filter(flown).copied().collect()
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

/// The processes of a throw, and who watches them.
struct Play {
    // In the order in which a failed test takes them down.
    operator: OperatorEnd,
    client: RpcClient<ControllerRpc>,
    chunks: ChunkSubscriber,
    state: StateReader,
    controller: Part,
    guardian: Part,
    planner: Part,
    camera: Part,
    arm: SimulatedArm,
    bus: Bus,
    recording: Vec<u8>,
    _sweep: DomainSweep,
}

impl Play {
    fn start(folder: &Path, name: &str) -> Self {
        let arm = arm();
        let domain = format!("identical_{name}_{}", std::process::id());
        let sweep = DomainSweep::new(&domain);
        let bus = Bus::join(&domain).unwrap();
        let chunks = bus.chunk_subscriber().unwrap();
        let config = patient(&domain, &arm);
        let planner = PlannerConfig {
            domain: domain.clone(),
            ..PlannerConfig::default()
        };
        let controller = Part::start(folder, "rt-controller", &config);
        let guardian = Part::start(folder, "guardian", &config);
        let planner = Part::start(folder, "planner", &planner);
        let camera = Part::start(folder, "camera-ingest", &CameraConfig { domain });
        let client = open::<ControllerRpc>(&bus, &ControllerRequest::Status);
        let operator = until("the operator's place", PATIENCE, || {
            OperatorEnd::take(&bus).ok()
        });
        Self {
            operator,
            client,
            chunks,
            state: StateReader::open(&bus).unwrap(),
            controller,
            guardian,
            planner,
            camera,
            arm,
            bus,
            recording: Vec::new(),
            _sweep: sweep,
        }
    }

    fn drain(&mut self) {
        while let Some(chunk) = self.chunks.receive().unwrap() {
            self.recording.extend_from_slice(&chunk);
        }
    }

    /// Waits for the last answer to a call; `meanwhile` is done every turn.
    fn answer(
        &mut self,
        pending: &Pending<ControllerRpc>,
        mut meanwhile: impl FnMut(&mut Self),
    ) -> ControllerEvent {
        until("an answer", PATIENCE, || {
            self.operator.beat();
            self.drain();
            meanwhile(self);
            pending.try_next().unwrap().filter(ControllerRpc::is_last)
        })
    }

    fn ask(&mut self, request: &ControllerRequest) -> ControllerEvent {
        let pending = self.client.call(request).unwrap();
        self.answer(&pending, |_| ())
    }

    /// Brings the arm up and arms it for the throw.
    fn arm_for_a_throw(&mut self, guardian_log: &Path) {
        assert_eq!(self.ask(&ControllerRequest::Bringup), ControllerEvent::Done);
        // The guardian may come a moment later than the controller.
        until("the guardian", PATIENCE, || {
            self.ask(&ControllerRequest::Status);
            let log = std::fs::read_to_string(guardian_log).ok()?;
            log.contains("guarding the controller").then_some(())
        });
        let armed = ControllerRequest::Arm {
            operating_mode: OperatingMode::Throw,
            area_clear: true,
        };
        assert_eq!(self.ask(&armed), ControllerEvent::Done);
    }

    /// Runs the plan to its end; with `murder`, planner and camera are killed when
    /// half of it is done.
    fn throw(&mut self, murder: bool) {
        let trajectory = Box::new(plan());
        let sha256 = trajectory_hash(&trajectory);
        let execute = ControllerRequest::Execute { trajectory, sha256 };
        let pending = self.client.call(&execute).unwrap();
        let mut begin = None;
        let end = self.answer(&pending, |play| {
            let now = play.state.get();
            if now.mode == ControllerMode::Streaming as u8 {
                let first = *begin.get_or_insert(now.cycle);
                if murder && now.cycle > first + HALF_WAY {
                    play.planner.kill();
                    play.camera.kill();
                }
            }
        });
        assert!(matches!(end, ControllerEvent::Finished { .. }), "{end:?}");
        let dead = self.planner.0.try_wait().unwrap().is_some();
        assert_eq!(dead, murder, "killed while the arm moved, or never");
    }

    /// Ends controller and guardian in order; cycles and causes.
    fn end(mut self) -> (Vec<CycleRecord>, Vec<CauseRecord>, SimulatedArm) {
        self.controller.end();
        self.guardian.end();
        self.drain();
        let (cycles, causes) = read(&self.recording);
        (cycles, causes, self.arm)
    }
}

/// Patient where only a busy machine would be noticed.
fn patient(domain: &str, arm: &SimulatedArm) -> ControllerConfig {
    let [joints, normal, rich, real] = arm.ports().reports;
    let mut config = ControllerConfig {
        domain: domain.to_owned(),
        command_port: arm.ports().command,
        report_port: joints,
        fallback_report_port: real,
        status_ports: [rich, normal],
        ..ControllerConfig::default()
    };
    let thresholds = &mut config.thresholds;
    thresholds.operator_timeout_ms = Some(5000.0);
    thresholds.reply_stall_ms = Some(500.0);
    thresholds.unanswered_max = Some(125);
    thresholds.report_stale_ms = Some(500.0);
    thresholds.late_cycles_max = Some(50);
    thresholds.missed_cycles_max = Some(50);
    config.guardian.silence_ms = 500.0;
    config
}

/// One throw of the plan; with `murder`, planner and camera are killed half-way,
/// both at work. Its cycles.
fn throw(folder: &Path, name: &str, murder: bool) -> Vec<CycleRecord> {
    let folder = folder.join(name);
    std::fs::create_dir(&folder).unwrap();
    let mut play = Play::start(&folder, name);
    // Both are at work: a throw is being planned, a film is being kept.
    let planner = open::<PlannerRpc>(&play.bus, &PlannerRequest::Ping);
    let planned = planner.call(&strike()).unwrap();
    play.arm_for_a_throw(&folder.join("guardian.log"));
    let camera = open::<CameraRpc>(&play.bus, &CameraRequest::Ping);
    let film = CameraRequest::Record {
        frames: 10_000,
        both_eyes: true,
    };
    let filmed = camera.call(&film).unwrap();
    let began = xarm_sim::clock::now();
    play.throw(murder);
    drop((planned, filmed));
    let (cycles, causes, arm) = play.end();
    // Its end at rest is a stop, too.
    let met: Vec<_> = causes.iter().map(|c| (c.fault(), c.motion_id)).collect();
    assert_eq!(met, [(FaultCode::OperatorStop, 0)]);
    let flown = of_the_throw(&cycles);
    // One that the loop was held up with is held back, by design.
    let went = flown.iter().filter(|r| r.send_ns > 0);
    let sent: BTreeSet<_> = went.map(|r| wire_bits(&r.q_c)).collect();
    let missing = sent.difference(&arrived(&arm, began)).count();
    assert_eq!(missing, 0, "setpoints that never reached the arm");
    flown
}

fn strike() -> PlannerRequest {
    let rope = RopeParams {
        links: 23,
        length_m: 0.55,
        joint_damping_nms_per_rad: 0.02,
        joint_stiffness_nm_per_rad: 0.3,
        radius_m: 0.006,
        mass_per_length_kg_per_m: 0.06,
        lead_mass_kg: 0.06,
        lead_radius_m: 0.025,
        link_extra_scale: 1.0,
    };
    let config = PlannerConfig::default();
    let goal = config.goal(Task::Strike, [0.95, 0.0, 0.2]);
    let options = PlanOptions {
        seed: 1,
        ..config.search
    };
    PlannerRequest::Plan(Box::new(PlanRequest::new(goal, &rope, options)))
}

/// A client of a service, once its process answers.
fn open<R: Rpc>(bus: &Bus, ping: &R::Request) -> RpcClient<R> {
    let client = RpcClient::<R>::open(bus).unwrap();
    let pending = until("a service", PATIENCE, || client.call(ping).ok());
    until("its answer", PATIENCE, || pending.try_next().unwrap());
    client
}

/// Each setpoint is the plan at its instant, to the bit. A machine that is late
/// sends some for other instants than the planned ones, none for another plan.
fn is_the_plan(flown: &[CycleRecord]) {
    let plan = plan();
    for record in flown {
        let planned = plan.state_at(record.trajectory_s).q;
        assert_eq!(
            bits(&record.q_c),
            bits(&planned),
            "at {} s",
            record.trajectory_s
        );
        // Behind its end it is followed no more.
        let rate = f64::from(record.trajectory_s < plan.duration_s());
        assert_eq!(record.speed_override.to_bits(), rate.to_bits());
    }
    let end_s = flown.last().unwrap().trajectory_s;
    assert!(end_s >= plan.duration_s(), "ended at {end_s} s");
}

#[test]
fn a_plan_runs_byte_for_byte_the_same_with_planner_and_camera_killed_half_way() {
    let folder = tempfile::tempdir().unwrap();
    let quiet = throw(folder.path(), "quiet", false);
    let killed = throw(folder.path(), "killed", true);
    is_the_plan(&quiet);
    is_the_plan(&killed);
    // Cycles for one instant of the plan have the same record, byte for byte.
    let by_instant: BTreeMap<u64, Vec<u8>> = quiet
        .iter()
        .map(|r| (r.trajectory_s.to_bits(), commanded(r)))
        .collect();
    let mut same = 0;
    for record in &killed {
        if let Some(bytes) = by_instant.get(&record.trajectory_s.to_bits()) {
            assert_eq!(bytes, &commanded(record), "at {} s", record.trajectory_s);
            same += 1;
        }
    }
    println!(
        "{same} cycles at the same instants of {} and {}",
        quiet.len(),
        killed.len()
    );
    assert!(same > 20, "{same}: this machine is late in every cycle");
}
