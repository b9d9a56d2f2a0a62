//! A test stand: arm, controller, guardian, and an operator who asks for things.

use super::child::{Process, Role};
use super::flight::Flight;
use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, JointVector};
use hil_tests::scenario::entry;
use rt_controller::ControllerConfig;
use rt_controller::config::{GuardianSettings, Profile, ThresholdSettings};
use rt_controller::os::RealTimeSettings;
use rt_controller::recording::{Item, LogReader, Read};
use rt_controller::session::ArmSession;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest, ControllerRpc};
use shared_types::ipc::rpc::{Pending, Rpc, RpcClient};
use shared_types::ipc::{Bus, ChunkSubscriber, ControllerMode, DomainSweep, OperatorEnd};
use shared_types::plan::trajectory_hash;
use shared_types::{FaultCode, MonotonicNs, OperatingMode};
use std::cell::OnceCell;
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::{Duration, Instant};
use xarm_sim::{ArmConfig, FaultScript, SimulatedArm, clock};

/// Stands go side by side, each in a domain and on ports of its own; one whose times are
/// judged goes alone.
static TURNS: RwLock<()> = RwLock::new(());

thread_local! {
    /// The turn of this thread's test, until the thread ends.
    static ALONE: OnceCell<RwLockWriteGuard<'static, ()>> = const { OnceCell::new() };
    static BESIDE_OTHERS: RwLockReadGuard<'static, ()> =
        TURNS.read().unwrap_or_else(PoisonError::into_inner);
}

/// No other stand is there until this test has ended.
pub fn alone() {
    let turn = || TURNS.write().unwrap_or_else(PoisonError::into_inner);
    ALONE.with(|alone| {
        alone.get_or_init(turn);
    });
}

/// Longest wait for anything.
pub const PATIENCE: Duration = Duration::from_secs(30);
/// Pause between two turns of the operator.
const TURN: Duration = Duration::from_millis(2);

/// A swing of three joints out and back, twice, 2.4 s; its fastest joint reaches
/// 0.8 rad/s.
pub fn swing(from: JointVector) -> JointTrajectory {
    swings(from, 2)
}

fn swings(from: JointVector, count: usize) -> JointTrajectory {
    let mut out = from;
    (out[1], out[3], out[5]) = (out[1] + 0.08, out[3] - 0.08, out[5] + 0.25);
    let (times, poses) = ([0.0, 0.6, 1.2, 1.8, 2.4], [from, out, from, out, from]);
    JointTrajectory::new(&times[..=2 * count], &poses[..=2 * count]).unwrap()
}

/// An arming whose area is confirmed clear at `confirmed`, if at all.
pub fn arm_for(operating_mode: OperatingMode, confirmed: Option<MonotonicNs>) -> ControllerRequest {
    ControllerRequest::Arm {
        operating_mode,
        confirmed_ns: confirmed.map(|at| at.0),
        begins_by_ns: None,
    }
}

pub fn execute(trajectory: &JointTrajectory) -> ControllerRequest {
    ControllerRequest::Execute {
        trajectory: Box::new(*trajectory),
        sha256: trajectory_hash(trajectory),
    }
}

/// A simulated arm in its start pose.
pub fn arm_on_free_ports(config: ArmConfig) -> SimulatedArm {
    SimulatedArm::start(ArmConfig {
        command_port: 0,
        report_ports: [0; 4],
        initial_q: START_POSE,
        ..config
    })
    .unwrap()
}

/// The controller's configuration for the arm, patient where only a busy machine
/// would be noticed.
pub fn patient(name: &str, arm: &SimulatedArm) -> ControllerConfig {
    let [realtime, normal, rich, real] = arm.ports().reports;
    ControllerConfig {
        domain: format!("faults_{name}_{}", std::process::id()),
        simulated: true,
        command_port: arm.ports().command,
        report_port: realtime,
        fallback_report_port: real,
        status_ports: [rich, normal],
        real_time: RealTimeSettings {
            // A test program is large; its memory stays where it is.
            lock_memory: false,
            ..RealTimeSettings::default()
        },
        thresholds: ThresholdSettings {
            profile: Some(Profile::Relaxed),
            operator_timeout_ms: Some(5000.0),
            guardian_timeout_ms: Some(1000.0),
            reply_stall_ms: Some(500.0),
            unanswered_max: Some(125),
            report_stale_ms: Some(500.0),
            missed_cycles_max: Some(50),
            late_cycles_max: Some(50),
            ..ThresholdSettings::default()
        },
        guardian: GuardianSettings {
            silence_ms: Some(1000.0),
            ..GuardianSettings::default()
        },
        ..ControllerConfig::default()
    }
}

/// Arm, controller, guardian and operator.
pub struct Stand {
    // The order of the fields is the order in which a failed test takes them down.
    /// `None` while nobody, or somebody else, has the operator's place.
    pub operator: Option<OperatorEnd>,
    client: RpcClient<ControllerRpc>,
    chunks: ChunkSubscriber,
    pub controller: Process,
    pub guardian: Option<Process>,
    pub arm: SimulatedArm,
    pub bus: Bus,
    pub config: ControllerConfig,
    recording: Vec<u8>,
    truth_ns: MonotonicNs,
    flight: Flight,
    _sweep: DomainSweep,
}

impl Stand {
    /// A stand without special settings.
    pub fn start(name: &str) -> Self {
        Self::with(name, ArmConfig::default(), |_| ())
    }

    /// The same with its arm brought up.
    pub fn ready(name: &str) -> Self {
        Self::ready_with(name, |_| ())
    }

    /// The same with changes to the controller's configuration.
    pub fn ready_with(name: &str, change: impl FnOnce(&mut ControllerConfig)) -> Self {
        let mut stand = Self::with(name, ArmConfig::default(), change);
        stand.make_ready();
        stand
    }

    /// A stand with an arm and changes to the controller's configuration of its
    /// own.
    pub fn with(name: &str, arm: ArmConfig, change: impl FnOnce(&mut ControllerConfig)) -> Self {
        if ALONE.with(|alone| alone.get().is_none()) {
            BESIDE_OTHERS.with(|_turn| ());
        }
        let arm = arm_on_free_ports(arm);
        let mut config = patient(name, &arm);
        change(&mut config);
        let sweep = DomainSweep::new(&config.domain);
        let bus = Bus::join(&config.domain).unwrap();
        let chunks = bus.chunk_subscriber().unwrap();
        let text = toml::to_string(&config).unwrap();
        let controller = Process::start(Role::Controller, name, &text);
        let guardian = config
            .guardian
            .required
            .then(|| Process::start(Role::Guardian, name, &text));
        let (operator, client) = meet(&bus, &controller);
        let truth_ns = clock::now();
        let mut stand = Self {
            operator: Some(operator),
            client,
            chunks,
            controller,
            guardian,
            flight: Flight {
                limits: config.resolve_limits().unwrap(),
                interface: config.command_interface,
                ..Flight::default()
            },
            arm,
            bus,
            config,
            recording: Vec::new(),
            truth_ns,
            _sweep: sweep,
        };
        stand.mode();
        stand
    }

    /// The operator's heartbeat, and what has come meanwhile.
    pub fn turn(&mut self) {
        if let Some(operator) = &mut self.operator {
            operator.beat();
        }
        self.drain();
        std::thread::sleep(TURN);
    }

    /// The same without a heartbeat.
    pub fn drain(&mut self) {
        while let Some(chunk) = self.chunks.receive().unwrap() {
            self.recording.extend_from_slice(&chunk);
        }
        let truth = self.arm.history().since(self.truth_ns);
        self.truth_ns = truth.last().map_or(self.truth_ns, |s| s.at);
        self.flight.truth.extend(truth);
    }

    /// Starts the controller anew in the same domain, after it was killed; the
    /// operator of the old one leaves.
    pub fn start_controller_again(&mut self) {
        self.operator = None;
        let text = toml::to_string(&self.config).unwrap();
        self.controller = Process::start(Role::Controller, "again", &text);
        let (operator, client) = meet(&self.bus, &self.controller);
        (self.operator, self.client) = (Some(operator), client);
    }

    /// Somebody else's connection to the arm.
    pub fn other_client(&self) -> ArmSession {
        let arm = (self.config.arm, self.config.command_port).into();
        ArmSession::connect(arm, PATIENCE).unwrap()
    }

    /// Turns for some time.
    pub fn rest(&mut self, span: Duration) {
        let began = Instant::now();
        while began.elapsed() < span {
            self.turn();
        }
    }

    pub fn wait_until(&mut self, what: &str, mut done: impl FnMut(&mut Self) -> bool) {
        let began = Instant::now();
        while !done(self) {
            assert!(
                began.elapsed() < PATIENCE,
                "{what} never came; the controller says:\n{}",
                self.controller.log()
            );
            self.turn();
        }
    }

    pub fn call(&mut self, request: &ControllerRequest) -> Pending<ControllerRpc> {
        self.client.call(request).unwrap()
    }

    /// Waits for the last answer to a call.
    pub fn answer(&mut self, pending: &Pending<ControllerRpc>) -> ControllerEvent {
        let mut last = None;
        self.wait_until("the answer", |s| match pending.try_next() {
            Ok(event) => {
                last = event.filter(ControllerRpc::is_last);
                last.is_some()
            }
            Err(error) => panic!("{error}:\n{}", s.controller.log()),
        });
        last.unwrap()
    }

    pub fn ask(&mut self, request: &ControllerRequest) -> ControllerEvent {
        let pending = self.call(request);
        self.answer(&pending)
    }

    /// Asks for what must be refused; the fault and the words.
    pub fn refused(&mut self, request: &ControllerRequest) -> (FaultCode, String) {
        let pending = self.call(request);
        self.refuses(&pending)
    }

    /// What was asked for is refused; the fault and the words.
    pub fn refuses(&mut self, pending: &Pending<ControllerRpc>) -> (FaultCode, String) {
        match self.answer(pending) {
            ControllerEvent::Refused { fault, message } => (fault, message),
            other => panic!("not refused: {other:?}"),
        }
    }

    /// Mode of the controller, and the pose that it commands (rad).
    fn status(&mut self) -> (ControllerMode, JointVector) {
        match self.ask(&ControllerRequest::Status) {
            ControllerEvent::Status { mode, q_c, .. } => (mode, q_c),
            other => panic!("{other:?}"),
        }
    }

    pub fn mode(&mut self) -> ControllerMode {
        self.status().0
    }

    /// Pose that the controller commands (rad).
    pub fn commanded(&mut self) -> JointVector {
        self.status().1
    }

    /// Brings the arm up, or acknowledges a fault; both want an arm that can be
    /// recovered by then.
    pub fn make_ready(&mut self) {
        self.wait_until("a ready arm", |s| {
            let request = match s.mode() {
                ControllerMode::Offline => ControllerRequest::Bringup,
                ControllerMode::Idle => return true,
                _ => ControllerRequest::Acknowledge,
            };
            s.ask(&request);
            false
        });
        // The guardian is seen by then, too.
        self.rest(Duration::from_millis(100));
    }

    pub fn arm_for(&mut self, operating_mode: OperatingMode) -> ControllerEvent {
        self.ask(&arm_for(operating_mode, Some(clock::now())))
    }

    /// Adds a fault of the arm that strikes when it is at speed.
    pub fn inject(&self, fault: &str) {
        let script: FaultScript = entry("on = 'speed:0.5'", fault).parse().unwrap();
        self.arm.inject(script.faults[0]);
    }

    /// What lets the arm swing from where it stands.
    pub fn swing_here(&mut self) -> ControllerRequest {
        execute(&swing(self.commanded()))
    }

    /// Arms and begins to swing from where the arm stands.
    pub fn begin(&mut self) -> Pending<ControllerRpc> {
        let from = self.commanded();
        assert_eq!(self.arm_for(OperatingMode::Throw), ControllerEvent::Done);
        self.call(&execute(&swing(from)))
    }

    /// Waits until the arm is asked to move faster than half a radian a second.
    pub fn wait_for_speed(&mut self) {
        self.wait_until("the motion", |s| s.is_fast());
    }

    /// Whether the arm moves faster than that.
    pub fn is_fast(&self) -> bool {
        self.arm
            .history()
            .latest()
            .is_some_and(|sample| sample.state.qd.max_abs() > 0.5)
    }

    /// Whether the guardian has asked the arm to stop.
    pub fn guardian_acted(&self) -> bool {
        self.guardian
            .as_ref()
            .is_some_and(|guardian| guardian.log().contains("the arm is asked to stop"))
    }

    /// A throw that a fault of the arm stops, as in [`stops`](Self::stops).
    pub fn stopped_by(&mut self, fault: &str, expected: &[FaultCode]) -> ControllerEvent {
        self.inject(fault);
        let pending = self.begin();
        self.stops(&pending, expected)
    }

    /// A motion is stopped: the answer names one of `expected`, and nothing moves until it
    /// is acknowledged. Returns what was answered.
    pub fn stops(
        &mut self,
        pending: &Pending<ControllerRpc>,
        expected: &[FaultCode],
    ) -> ControllerEvent {
        let answer = self.answer(pending);
        let ControllerEvent::Stopped { fault, .. } = answer else {
            panic!("not stopped: {answer:?}");
        };
        assert!(expected.contains(&fault), "{answer:?}");
        self.expect(expected);
        self.is_latched();
        answer
    }

    /// The stop that has just been answered holds, whatever is asked for.
    pub fn is_latched(&mut self) {
        assert_eq!(self.mode(), ControllerMode::Faulted);
        let from = self.commanded();
        for request in [
            arm_for(OperatingMode::Throw, Some(clock::now())),
            ControllerRequest::MoveTo {
                q: START_POSE,
                speed_fraction: 0.1,
            },
            execute(&swing(from)),
            ControllerRequest::Bringup,
        ] {
            assert_eq!(self.refused(&request).0, FaultCode::WrongMode);
        }
        // Time to come to rest, then time in which nothing may move.
        self.rest(Duration::from_millis(700));
        let from_ns = clock::now();
        self.rest(Duration::from_millis(500));
        self.flight.at_rest.push((from_ns, clock::now()));
    }

    /// Arms and swings to the end; when that was (ns).
    pub fn throws(&mut self) -> [u64; 2] {
        let pending = self.begin();
        self.finishes(&pending)
    }

    /// Asks for a motion, which goes on to its end.
    pub fn moves(&mut self, request: &ControllerRequest) {
        let pending = self.call(request);
        self.finishes(&pending);
    }

    /// A motion goes on to its end; when that was (ns).
    pub fn finishes(&mut self, pending: &Pending<ControllerRpc>) -> [u64; 2] {
        match self.answer(pending) {
            ControllerEvent::Finished { start_ns, end_ns } => [start_ns, end_ns],
            other => panic!("not finished: {other:?}"),
        }
    }

    /// After an acknowledgement the arm works as before, as one swing shows.
    pub fn works_again(&mut self) {
        self.make_ready();
        let once = swings(self.commanded(), 1);
        assert_eq!(self.arm_for(OperatingMode::Throw), ControllerEvent::Done);
        self.moves(&execute(&once));
    }

    /// Works again, and that was all.
    pub fn recovers(mut self) -> Flight {
        self.works_again();
        self.finish()
    }

    /// The next stop is one for one of `faults`.
    pub fn expect(&mut self, faults: &[FaultCode]) {
        self.flight.expected.push(faults.to_vec());
    }

    /// Ends all processes in order and hands over what was recorded, checked.
    pub fn finish(mut self) -> Flight {
        if self.mode() == ControllerMode::Idle {
            // Its end is one more stop, of an arm that stands.
            self.expect(&[FaultCode::OperatorStop]);
        }
        self.controller.end();
        if let Some(guardian) = &mut self.guardian {
            guardian.end();
        }
        self.drain();
        self.flight.arm = self.arm.events().since(MonotonicNs(0));
        for read in LogReader::open(&self.recording).unwrap() {
            match read {
                Read::Item(Item::Cycle(cycle)) => self.flight.cycles.push(*cycle),
                Read::Item(Item::Cause(cause)) => self.flight.causes.push(*cause),
                Read::Item(Item::Keyframe(_) | Item::Motion { .. }) => {}
                Read::Flaw(flaw) => panic!("{flaw}"),
            }
        }
        self.flight.check();
        self.flight
    }
}

/// Waits until the operator's place and the service are there.
fn meet(bus: &Bus, controller: &Process) -> (OperatorEnd, RpcClient<ControllerRpc>) {
    let began = Instant::now();
    loop {
        if let (Ok(end), Ok(client)) = (OperatorEnd::take(bus), RpcClient::open(bus))
            && client.call(&ControllerRequest::Status).is_ok()
        {
            return (end, client);
        }
        assert!(
            began.elapsed() < PATIENCE,
            "the controller never came:\n{}",
            controller.log()
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}
