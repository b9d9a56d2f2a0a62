//! The whole controller process against a small arm on TCP: bring-up, move,
//! trajectory, refusals, stop, acknowledgement, a lost arm, the end.
#![cfg(test)]

use arm_model::joint::START_POSE;
use arm_model::{JointState, JointTrajectory, JointVector};
use rt_controller::commander::CommanderLock;
use rt_controller::config::ThresholdSettings;
use rt_controller::guardian::GuardianSettings;
use rt_controller::os::{RealTimeSettings, now_ns};
use rt_controller::xarm::frame::MAX_FRAME_LEN;
use rt_controller::xarm::report::{BasicReport, MAX_REPORT_LEN, NormalReport, RealtimeReport};
use rt_controller::xarm::{
    ArmState, Command, ErrorCode, FrameReader, Mode, ReplyData, Status, TcpPose,
};
use rt_controller::{ControllerConfig, run};
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::RpcClient;
use shared_types::ipc::{Bus, ControllerMode, IpcError, OperatorEnd};
use shared_types::plan::trajectory_hash;
use shared_types::{FaultCode, OperatingMode};
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// An arm without a body: it stands at once where the last setpoint says.
#[derive(Clone)]
struct SmallArm {
    q: Arc<Mutex<JointVector>>,
    off: Arc<AtomicBool>,
    ports: [u16; 3],
}

impl SmallArm {
    fn start(q: JointVector) -> Self {
        let (commands, reports, status) = (listen(), listen(), listen());
        let arm = Self {
            q: Arc::new(Mutex::new(q)),
            off: Arc::new(AtomicBool::new(false)),
            ports: [&commands, &reports, &status].map(|l| l.local_addr().unwrap().port()),
        };
        for (listener, serve) in [
            (commands, Self::answer as fn(&Self, TcpStream)),
            (reports, Self::report),
            (status, Self::tell_status),
        ] {
            let arm = arm.clone();
            std::thread::spawn(move || {
                for stream in listener.incoming() {
                    let (arm, stream) = (arm.clone(), stream.unwrap());
                    if arm.off.load(Ordering::Relaxed) {
                        return;
                    }
                    std::thread::spawn(move || serve(&arm, stream));
                }
            });
        }
        arm
    }

    fn answer(&self, mut stream: TcpStream) {
        stream.set_nodelay(true).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_millis(50)))
            .unwrap();
        let mut reader = FrameReader::new();
        let mut out = [0; MAX_FRAME_LEN];
        while !self.off.load(Ordering::Relaxed) {
            match stream.read(reader.space()) {
                Ok(0) => return,
                Ok(n) => reader.commit(n),
                Err(_silence) => continue,
            }
            while let Some(frame) = reader.next_frame().unwrap() {
                let request = frame.as_request().unwrap();
                let command = Command::parse(request.register, request.parameters).unwrap();
                let n = self
                    .execute(&command)
                    .emit(&mut out, &request, Status(0))
                    .unwrap();
                if stream.write_all(&out[..n]).is_err() {
                    return;
                }
            }
        }
    }

    fn execute(&self, command: &Command) -> ReplyData {
        match command {
            Command::ServoJoint(q) => {
                *self.q.lock().unwrap() = *q;
                ReplyData::None
            }
            Command::Version => ReplyData::Text(rt_controller::xarm::reply::Text::new(
                "7,7,XS1305,AC1304,v2.7.1",
            )),
            Command::GetState => ReplyData::State(ArmState::Ready),
            Command::GetFault => ReplyData::Fault {
                error: 0,
                warning: 0,
            },
            Command::GetSpeedLimitFactor => ReplyData::SpeedLimitFactor(1.2),
            Command::JointPosition(_) => ReplyData::JointMotion {
                quantities: 1,
                position: *self.q.lock().unwrap(),
                velocity: JointVector::ZERO,
                effort: JointVector::ZERO,
            },
            _ => ReplyData::None,
        }
    }

    fn tell_status(&self, mut stream: TcpStream) {
        let mut out = [0; MAX_REPORT_LEN];
        while !self.off.load(Ordering::Relaxed) {
            let report = NormalReport {
                basic: BasicReport {
                    state: ArmState::Ready,
                    mode: Mode::Servo,
                    buffered: 0,
                    q: *self.q.lock().unwrap(),
                    tcp: TcpPose::default(),
                    torque_nm: JointVector::ZERO,
                },
                brakes_released: 0x7F,
                enabled: 0x7F,
                error: ErrorCode::NONE,
                warning: 0,
                tcp_offset: TcpPose::default(),
                load_kg: 0.0,
                load_centre_m: [0.0; 3],
                collision_sensitivity: 3,
                teach_sensitivity: 3,
                gravity: [0.0, 0.0, -1.0],
            };
            let n = report.emit(&mut out).unwrap();
            if stream.write_all(&out[..n]).is_err() {
                return;
            }
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    fn report(&self, mut stream: TcpStream) {
        let mut out = [0; MAX_REPORT_LEN];
        while !self.off.load(Ordering::Relaxed) {
            let at = JointState::at_rest(*self.q.lock().unwrap());
            let report = RealtimeReport {
                time_us: now_ns() / 1000,
                state: ArmState::Moving,
                mode: Mode::Servo,
                buffered: 0,
                target: at,
                actual: at,
                current_a: JointVector::ZERO,
                torque_nm: JointVector::ZERO,
                target_tcp: TcpPose::default(),
                target_twist: TcpPose::default(),
                actual_tcp: TcpPose::default(),
                actual_twist: TcpPose::default(),
            };
            let n = report.emit(&mut out).unwrap();
            if stream.write_all(&out[..n]).is_err() {
                return;
            }
            std::thread::sleep(Duration::from_millis(4));
        }
    }
}

fn listen() -> TcpListener {
    TcpListener::bind("127.0.0.1:0").unwrap()
}

fn config(domain: &str, arm: &SmallArm) -> ControllerConfig {
    ControllerConfig {
        domain: domain.to_owned(),
        command_port: arm.ports[0],
        report_port: arm.ports[1],
        fallback_report_port: arm.ports[1],
        status_ports: [arm.ports[2]; 2],
        // The machine may be busy with other tests: patience, no privileges.
        real_time: RealTimeSettings {
            priority: None,
            lock_memory: false,
            ..RealTimeSettings::default()
        },
        thresholds: ThresholdSettings {
            operator_timeout_ms: Some(5000.0),
            reply_stall_ms: Some(5000.0),
            report_stale_ms: Some(5000.0),
            tracking_window_ms: Some(200.0),
            tracking_error_max_rad: Some(0.5),
            missed_cycles_max: Some(1000),
            late_cycles_max: Some(1000),
            unanswered_max: Some(1000),
            ..ThresholdSettings::default()
        },
        arming_required: false,
        guardian: GuardianSettings {
            required: false,
            ..GuardianSettings::default()
        },
        ..ControllerConfig::default()
    }
}

struct Operator {
    client: RpcClient<ControllerRpc>,
    end: OperatorEnd,
}

impl Operator {
    fn ask(&mut self, request: &ControllerRequest) -> ControllerEvent {
        let pending = self.client.call(request).unwrap();
        let beat = || -> Result<(), IpcError> {
            self.end.beat();
            Ok(())
        };
        pending
            .finish(Duration::from_secs(20), beat, |_| ())
            .unwrap()
    }

    fn refused(&mut self, request: &ControllerRequest) -> FaultCode {
        match self.ask(request) {
            ControllerEvent::Refused { fault, message } => {
                assert!(message.len() > 20, "{message}");
                fault
            }
            other => panic!("{other:?}"),
        }
    }

    fn mode(&mut self) -> (ControllerMode, FaultCode) {
        match self.ask(&ControllerRequest::Status) {
            ControllerEvent::Status { mode, fault, .. } => (mode, fault),
            other => panic!("{other:?}"),
        }
    }
}

fn execute(trajectory: &JointTrajectory) -> ControllerRequest {
    ControllerRequest::Execute {
        trajectory: Box::new(*trajectory),
        sha256: trajectory_hash(trajectory),
    }
}

fn swing(by_rad: f64, in_s: f64) -> JointTrajectory {
    let mut side = START_POSE;
    side[5] += by_rad;
    JointTrajectory::new(&[0.0, in_s / 2.0, in_s], &[START_POSE, side, START_POSE]).unwrap()
}

#[test]
fn a_day_in_the_life() {
    let mut resting = START_POSE;
    resting[0] = 0.1;
    let arm = SmallArm::start(resting);
    let domain = format!("test_process_{}", std::process::id());
    let stop = Arc::new(AtomicBool::new(false));
    let controller = {
        let (config, stop) = (config(&domain, &arm), Arc::clone(&stop));
        std::thread::spawn(move || run(config, &stop))
    };
    let bus = Bus::join(&domain).unwrap();
    let mut operator = loop {
        std::thread::sleep(Duration::from_millis(20));
        if let (Ok(end), Ok(client)) = (OperatorEnd::take(&bus), RpcClient::open(&bus)) {
            let here = client.call(&ControllerRequest::Status).is_ok();
            if here {
                break Operator { client, end };
            }
        }
    };
    let to_start = ControllerRequest::MoveTo {
        q: START_POSE,
        speed_part: 0.5,
    };
    assert_eq!(operator.refused(&to_start), FaultCode::WrongMode);
    assert_eq!(
        operator.ask(&ControllerRequest::Bringup),
        ControllerEvent::Done
    );
    let throw = swing(-0.3, 0.8);
    assert_eq!(
        operator.refused(&execute(&throw)),
        FaultCode::StartPoseMismatch
    );
    assert!(matches!(
        operator.ask(&to_start),
        ControllerEvent::Finished { .. }
    ));
    assert!((*arm.q.lock().unwrap() - START_POSE).max_abs() < 1e-6);

    let damaged = ControllerRequest::Execute {
        trajectory: Box::new(throw),
        sha256: [7; 32],
    };
    assert_eq!(operator.refused(&damaged), FaultCode::PlanHashMismatch);
    let wild = execute(&swing(-1.5, 0.5));
    assert_eq!(operator.refused(&wild), FaultCode::PlanOutOfLimits);
    match operator.ask(&execute(&throw)) {
        ControllerEvent::Finished { start_ns, end_ns } => {
            let lasted_ns = end_ns - start_ns;
            assert!(
                (800_000_000..3_000_000_000).contains(&lasted_ns),
                "{lasted_ns}"
            );
        }
        other => panic!("{other:?}"),
    }

    // A stop is served while the trajectory runs, and both callers hear of it.
    let pending = operator.client.call(&execute(&swing(-0.5, 8.0))).unwrap();
    while operator.mode().0 != ControllerMode::Streaming {}
    assert_eq!(
        operator.ask(&ControllerRequest::Stop),
        ControllerEvent::Done
    );
    let end = pending.finish::<IpcError>(Duration::from_secs(5), || Ok(()), |_| ());
    let fault = FaultCode::OperatorStop;
    assert!(
        matches!(end, Ok(ControllerEvent::Stopped { fault: f, .. }) if f == fault),
        "{end:?}"
    );
    assert_eq!(operator.mode(), (ControllerMode::Faulted, fault));
    assert_eq!(
        operator.ask(&ControllerRequest::Acknowledge),
        ControllerEvent::Done
    );
    assert_eq!(operator.mode().0, ControllerMode::Idle);
    assert!(matches!(
        operator.ask(&to_start),
        ControllerEvent::Finished { .. }
    ));
    match operator.ask(&ControllerRequest::Latency) {
        ControllerEvent::Latency(report) => {
            assert!(
                report.cycles > 200 && report.reply.count > 100,
                "{report:?}"
            );
        }
        other => panic!("{other:?}"),
    }

    // The arm goes away on the way: reported, latched, still served.
    let pending = operator.client.call(&execute(&swing(-0.5, 8.0))).unwrap();
    while operator.mode().0 != ControllerMode::Streaming {}
    arm.off.store(true, Ordering::Relaxed);
    let end = pending.finish::<IpcError>(Duration::from_secs(5), || Ok(()), |_| ());
    let fault = FaultCode::LinkLost;
    assert!(
        matches!(end, Ok(ControllerEvent::Stopped { fault: f, .. }) if f == fault),
        "{end:?}"
    );
    assert_eq!(operator.mode(), (ControllerMode::Faulted, fault));

    stop.store(true, Ordering::Relaxed);
    controller.join().unwrap().unwrap();
}

/// A running controller and its operator; the controller ends when dropped.
struct Running {
    operator: Operator,
    stop: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Running {
    fn start(config: ControllerConfig) -> Self {
        let (stop, domain) = (Arc::new(AtomicBool::new(false)), config.domain.clone());
        let flag = Arc::clone(&stop);
        let thread = std::thread::spawn(move || run(config, &flag).unwrap());
        let bus = Bus::join(&domain).unwrap();
        let operator = loop {
            std::thread::sleep(Duration::from_millis(20));
            if let (Ok(end), Ok(client)) = (OperatorEnd::take(&bus), RpcClient::open(&bus))
                && client.call(&ControllerRequest::Status).is_ok()
            {
                break Operator { client, end };
            }
        };
        Self {
            operator,
            stop,
            thread: Some(thread),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.thread.take().unwrap().join().unwrap();
    }
}

#[test]
fn motions_need_an_arming_and_plans_come_in_time() {
    let arm = SmallArm::start(START_POSE);
    let mut config = config(&format!("test_arming_{}", std::process::id()), &arm);
    config.arming_required = true;
    let mut running = Running::start(config);
    let operator = &mut running.operator;
    let arm_for = |operating_mode, area_clear| ControllerRequest::Arm {
        operating_mode,
        area_clear,
    };
    let setting_up = arm_for(OperatingMode::SetUp, false);
    assert_eq!(operator.refused(&setting_up), FaultCode::WrongMode);
    assert_eq!(
        operator.ask(&ControllerRequest::Bringup),
        ControllerEvent::Done
    );
    let throw = swing(-0.3, 0.8);
    assert_eq!(operator.refused(&execute(&throw)), FaultCode::NotArmed);
    let blind = arm_for(OperatingMode::Throw, false);
    assert_eq!(operator.refused(&blind), FaultCode::NotArmed);
    let armed = arm_for(OperatingMode::Throw, true);
    assert_eq!(operator.ask(&armed), ControllerEvent::Done);
    match operator.ask(&ControllerRequest::Status) {
        ControllerEvent::Status { operating_mode, .. } => {
            assert_eq!(operating_mode, Some(OperatingMode::Throw))
        }
        other => panic!("{other:?}"),
    }
    assert_eq!(
        operator.ask(&ControllerRequest::Disarm),
        ControllerEvent::Done
    );
    assert_eq!(operator.refused(&execute(&throw)), FaultCode::NotArmed);

    // An announced plan that never comes, and one that does.
    let sha256 = trajectory_hash(&throw);
    let announce = ControllerRequest::Announce { sha256 };
    assert_eq!(operator.refused(&announce), FaultCode::UploadTimedOut);
    let unknown = ControllerRequest::ExecuteUploaded { sha256 };
    assert_eq!(operator.refused(&unknown), FaultCode::WrongMode);
    let upload = |sha256| ControllerRequest::Upload {
        trajectory: Box::new(throw),
        sha256,
    };
    assert_eq!(
        operator.refused(&upload([1; 32])),
        FaultCode::PlanHashMismatch
    );
    let pending = operator.client.call(&announce).unwrap();
    assert_eq!(operator.ask(&upload(sha256)), ControllerEvent::Done);
    let there = pending.finish::<IpcError>(Duration::from_secs(5), || Ok(()), |_| ());
    assert!(matches!(there, Ok(ControllerEvent::Done)), "{there:?}");
    assert_eq!(operator.ask(&armed), ControllerEvent::Done);
    assert!(matches!(
        operator.ask(&unknown),
        ControllerEvent::Finished { .. }
    ));
    // One arming, one throw.
    assert_eq!(operator.refused(&unknown), FaultCode::NotArmed);
}

#[test]
fn another_commander_or_another_tool_is_a_refusal_that_says_what() {
    let arm = SmallArm::start(START_POSE);
    let mut config = config(&format!("test_refusals_{}", std::process::id()), &arm);
    let mut spec = arm_model::LimitsSpec::from(arm_model::Limits::default());
    spec.tcp_speed_max_m_s = 1.0;
    config.limits = Some(spec.try_into().unwrap());
    let mut running = Running::start(config.clone());
    let lock = CommanderLock::take((config.arm, config.command_port).into()).unwrap();
    let refusal = |running: &mut Running| match running.operator.ask(&ControllerRequest::Bringup) {
        ControllerEvent::Refused { fault, message } => (fault, message),
        other => panic!("{other:?}"),
    };
    let (fault, message) = refusal(&mut running);
    assert_eq!(fault, FaultCode::SecondCommander);
    let me = format!("process {}", std::process::id());
    assert!(message.contains(&me), "{message}");
    drop(lock);
    let (fault, message) = refusal(&mut running);
    assert_eq!(fault, FaultCode::ArmDiffers);
    assert!(
        message.contains("1.200") && message.contains("1.000"),
        "{message}"
    );
}

#[test]
fn required_real_time_that_cannot_be_had_is_a_refusal() {
    let arm = SmallArm::start(START_POSE);
    let mut config = config(&format!("test_require_{}", std::process::id()), &arm);
    config.real_time.cpu = Some(1_000_000);
    config.real_time.require = true;
    let error = run(config, &AtomicBool::new(false))
        .unwrap_err()
        .to_string();
    assert!(error.contains("core 1000000"), "{error}");
}
