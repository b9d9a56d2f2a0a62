//! The simulated arm over real sockets, as clients see it.
#![cfg(test)]
#![allow(clippy::float_cmp, reason = "tests compare exact numbers")]

use arm_model::JointVector;
use hil_tests::scenario::bring_up;
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::xarm::frame::{MAX_FRAME_LEN, emit_command};
use rt_controller::xarm::report::{ForceReport, NormalReport, RealtimeReport, RichReport};
use rt_controller::xarm::{
    ArmState, Command, FrameReader, JointQuery, Mode, Protocol, ReplyData, ReportReader,
    StateRequest, Status,
};
use shared_types::MonotonicNs;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::time::Duration;
use xarm_sim::clock;
use xarm_sim::fault::{FaultKind, PortSet};
use xarm_sim::{ArmConfig, ArmEvent, ArmStartError, Fault, JointSample, SimulatedArm, Trigger};

fn try_start(command_port: u16) -> Result<SimulatedArm, ArmStartError> {
    SimulatedArm::start(ArmConfig {
        command_port,
        report_ports: [0; 4],
        ..ArmConfig::default()
    })
}

fn start() -> SimulatedArm {
    try_start(0).unwrap()
}

fn connect(port: u16) -> TcpStream {
    let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
    stream.set_nodelay(true).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(5)))
        .unwrap();
    stream
}

/// A client of the command port.
struct Client {
    stream: TcpStream,
    reader: FrameReader,
    transaction: u16,
}

impl Client {
    fn new(arm: &SimulatedArm) -> Self {
        Self {
            stream: connect(arm.ports().command),
            reader: FrameReader::new(),
            transaction: 0,
        }
    }

    fn ask(&mut self, command: &Command) -> (Status, ReplyData) {
        self.transaction += 1;
        let mut out = [0; MAX_FRAME_LEN];
        let n = emit_command(&mut out, self.transaction, Protocol::Private, command).unwrap();
        self.stream.write_all(&out[..n]).unwrap();
        loop {
            if let Some(frame) = self.reader.next_frame().unwrap() {
                let reply = frame.as_reply().unwrap();
                assert_eq!(reply.transaction, self.transaction);
                return (reply.status, ReplyData::parse(command, &reply).unwrap());
            }
            let n = self.stream.read(self.reader.space()).unwrap();
            assert!(n > 0, "connection closed");
            self.reader.commit(n);
        }
    }

    fn bring_up(&mut self, mode: Mode) {
        for command in bring_up(mode) {
            self.ask(&command);
        }
        assert_eq!(self.state(), ArmState::Ready);
    }

    fn state(&mut self) -> ArmState {
        match self.ask(&Command::GetState).1 {
            ReplyData::State(state) => state,
            other => panic!("{other:?}"),
        }
    }

    fn q(&mut self) -> JointVector {
        match self.ask(&Command::JointPosition(JointQuery::MEASURED)).1 {
            ReplyData::JointMotion { position, .. } => position,
            other => panic!("{other:?}"),
        }
    }
}

fn wait_s(span_s: f64) {
    std::thread::sleep(Duration::from_secs_f64(span_s));
}

fn read_reports(port: u16, count: usize) -> Vec<(MonotonicNs, Vec<u8>)> {
    let mut stream = connect(port);
    let mut reader = ReportReader::new();
    let mut reports = Vec::new();
    while reports.len() < count {
        let n = stream.read(reader.space()).unwrap();
        assert!(n > 0, "connection closed");
        reader.commit(n);
        while let Some(report) = reader.next_report().unwrap() {
            reports.push((clock::now(), report.to_vec()));
        }
    }
    reports
}

/// A request that is proper, damaged, or no request at all.
fn odd_frame(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let register = *[1, 13, 21, 29, 30, 42, 52, 81, 82, 232, 254, rng.random()]
        .choose(rng)
        .unwrap();
    let mut parameters = vec![0; rng.random_range(0..60)];
    rng.fill_bytes(&mut parameters);
    let body = u16::try_from(1 + parameters.len()).unwrap();
    let mut protocol: u16 = 2 + rng.random_range(0..2);
    let mut claimed = body;
    match rng.random_range(0..10) {
        0 => protocol = rng.random(),
        1 => claimed = rng.random(),
        2 => claimed = *[0, 1, 399, 400, 401, u16::MAX].choose(rng).unwrap(),
        3 => protocol = rng.random_range(0..2),
        _ => {}
    }
    let mut frame = rng.random::<u16>().to_be_bytes().to_vec();
    frame.extend(protocol.to_be_bytes());
    frame.extend(claimed.to_be_bytes());
    frame.push(register);
    frame.extend(parameters);
    match rng.random_range(0..8) {
        0 => frame.truncate(rng.random_range(0..frame.len())),
        1 => rng.fill_bytes(&mut frame),
        _ => {}
    }
    frame
}

/// Ten thousand frames in bursts, split and merged at random: after each burst
/// a fresh client gets its version.
#[test]
fn random_and_broken_frames_never_wedge_it() {
    const BURSTS: usize = 100;
    const FRAMES: usize = 100;
    let arm = start();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    for burst in 0..BURSTS {
        let mut bytes: Vec<u8> = (0..FRAMES).flat_map(|_| odd_frame(&mut rng)).collect();
        while !bytes.is_empty() {
            // The arm closes a hopeless connection; the rest goes on a new one.
            let mut bad = connect(arm.ports().command);
            let part = rng.random_range(1..=bytes.len().min(4000));
            for piece in bytes[..part].chunks(rng.random_range(1..1500)) {
                if bad.write_all(piece).is_err() {
                    break;
                }
            }
            bytes.drain(..part);
        }
        let reply = Client::new(&arm).ask(&Command::Version).1;
        let ReplyData::Text(version) = reply else {
            panic!("burst {burst}: {reply:?}");
        };
        assert_eq!(version.as_str(), "7,7,XS1305,AC1304,v2.7.1");
    }
}

#[test]
fn heartbeats_are_ignored_and_an_unknown_register_is_answered_as_invalid() {
    let arm = start();
    let mut stream = connect(arm.ports().command);
    stream.write_all(&[0, 0, 0, 1, 0, 2, 0, 0]).unwrap();
    stream.write_all(&[0, 5, 0, 3, 0, 2, 0xEE, 9]).unwrap();
    let mut reply = [0; 8];
    stream.read_exact(&mut reply).unwrap();
    assert_eq!(reply[..7], [0, 5, 0, 3, 0, 2, 0xEE]);
    assert!(Status(reply[7]).is_invalid() && Status(reply[7]).has_warning());
}

#[test]
fn two_clients_share_one_arm() {
    let arm = start();
    let (mut a, mut b) = (Client::new(&arm), Client::new(&arm));
    a.bring_up(Mode::Servo);
    assert_eq!(b.state(), ArmState::Ready);
    let mut target = JointVector::ZERO;
    target[6] = 0.02;
    a.ask(&Command::ServoJoint(target));
    wait_s(0.3);
    assert!((b.q() - target).max_abs() < 1e-4);
    b.ask(&Command::SetState(StateRequest::Stop));
    assert!(a.ask(&Command::ServoJoint(target)).0.is_not_ready());
    // What one does wrong, the other is told, too: C23, outside a joint's range.
    a.bring_up(Mode::Servo);
    target[3] = -1.0;
    assert!(a.ask(&Command::ServoJoint(target)).0.has_error());
    let fault = b.ask(&Command::GetFault).1;
    assert!(
        matches!(fault, ReplyData::Fault { error: 23, .. }),
        "{fault:?}"
    );
}

/// Four clients of the real-time report at once, a fifth is turned away; five
/// of the command port are served side by side.
#[test]
fn as_many_clients_as_a_real_arm_takes() {
    let arm = start();
    let [realtime, ..] = arm.ports().reports;
    let mut streams: Vec<_> = (0..4).map(|_| connect(realtime)).collect();
    let mut frame = [0; 784];
    for stream in &mut streams {
        stream.read_exact(&mut frame).unwrap();
    }
    let mut fifth = connect(realtime);
    assert!(matches!(fifth.read(&mut frame), Ok(0) | Err(_)));
    drop(streams.pop());
    wait_s(0.1);
    connect(realtime).read_exact(&mut frame).unwrap();

    let mut clients: Vec<_> = (0..5).map(|_| Client::new(&arm)).collect();
    clients[0].bring_up(Mode::Servo);
    for client in &mut clients {
        assert_eq!(client.state(), ArmState::Ready);
    }
}

/// Injects a fault and waits until it has begun, however late the arm's thread gets to run.
fn begin(arm: &SimulatedArm, fault: Fault) {
    arm.inject(fault);
    let begun = |event: &ArmEvent| match event {
        ArmEvent::Fault { kind, begins, .. } => *begins && *kind == fault.kind,
        _ => false,
    };
    for _ in 0..100 {
        let events = arm.events().since(MonotonicNs(0));
        if events.iter().any(|e| begun(&e.event)) {
            return wait_s(0.1);
        }
        wait_s(0.05);
    }
    panic!("{:?} did not begin within 5 s", fault.kind);
}

/// The same faults as in virtual time, over real sockets.
#[test]
fn faults_of_the_wire_reach_the_sockets() {
    let fault = |kind, duration_s| Fault {
        trigger: Trigger::At(0.0),
        duration_s,
        kind,
    };
    let arm = start();
    let mut client = Client::new(&arm);
    client.state();
    arm.inject(fault(FaultKind::Stall, Some(0.3)));
    wait_s(0.05);
    let requested = clock::now();
    client.state();
    let waited_s = clock::now().since_s(requested);
    assert!(waited_s > 0.15, "{waited_s} s");

    let ports = PortSet::All;
    let mut reports = connect(arm.ports().reports[0]);
    let mut byte = [0; 2048];
    // Something has come: the arm has taken the connection up, so that the fault meets it.
    assert!(reports.read(&mut byte).unwrap() > 0);
    begin(&arm, fault(FaultKind::ConnectionReset { ports }, None));
    let error = client.stream.read(&mut byte).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::ConnectionReset);
    while reports.read(&mut byte).is_ok() {}

    let mut client = Client::new(&arm);
    // Answered: this one is taken up, too.
    client.state();
    begin(&arm, fault(FaultKind::HalfOpen { ports }, None));
    let timeout = Some(Duration::from_millis(200));
    client.stream.set_read_timeout(timeout).unwrap();
    client.stream.write_all(&[0, 1, 0, 2, 0, 1, 13]).unwrap();
    let error = client.stream.read(&mut byte).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::WouldBlock);
    assert_eq!(Client::new(&arm).state(), ArmState::Stopped);
}

#[test]
fn reports_come_at_once_and_agree_with_the_commands() {
    let arm = start();
    let mut client = Client::new(&arm);
    client.bring_up(Mode::Servo);
    let [realtime, normal, rich, real] = arm.ports().reports;
    let requested = clock::now();
    let (came, frame) = read_reports(rich, 1).remove(0);
    // Far less than the 200 ms between two of them.
    assert!(came.since_s(requested) < 0.15);
    let rich = RichReport::parse(&frame).unwrap();
    assert_eq!(rich.normal.basic.mode, Mode::Servo);
    assert_eq!(
        (rich.normal.enabled, rich.normal.brakes_released),
        (0x7F, 0x7F)
    );
    let normal = NormalReport::parse(&read_reports(normal, 1)[0].1).unwrap();
    assert_eq!(normal, rich.normal);
    let real = ForceReport::parse(&read_reports(real, 2)[1].1).unwrap();
    assert_eq!(real.basic.state, ArmState::Ready);
    // The zero pose of the vendor's check values.
    let [x, y, z] = real.basic.tcp.position_m;
    assert!((x - 0.206).abs() < 1e-6 && y.abs() < 1e-6 && (z - 0.1205).abs() < 1e-6);

    let frames: Vec<_> = read_reports(realtime, 100)
        .iter()
        .map(|(_, frame)| RealtimeReport::parse(frame).unwrap())
        .collect();
    assert!(frames.windows(2).all(|w| w[1].time_us > w[0].time_us));
}

/// Simulated time is monotonic time: reports and history carry its stamps.
#[test]
fn history_is_gapless_and_on_the_monotonic_clock() {
    let arm = start();
    wait_s(0.3);
    let now = clock::now();
    // Any request brings the model up to the present.
    Client::new(&arm).state();
    let samples = arm.history().since(MonotonicNs(0));
    assert!(samples.len() >= 295, "{}", samples.len());
    let gapless = |w: &[JointSample]| w[1].at.0 - w[0].at.0 == 1_000_000;
    assert!(samples.windows(2).all(gapless));
    let last = samples.last().unwrap().at;
    assert!(last.since_s(now) > -0.001, "{} s behind", now.since_s(last));
}

/// A client that never reads loses reports; nobody else notices.
#[test]
fn a_slow_reader_blocks_nobody() {
    let arm = start();
    let [realtime, ..] = arm.ports().reports;
    let _sleeper = connect(realtime);
    wait_s(0.5);
    assert_eq!(read_reports(realtime, 20).len(), 20);
    assert_eq!(Client::new(&arm).state(), ArmState::Stopped);
}

#[test]
fn a_port_in_use_is_named_with_its_remedy() {
    let arm = start();
    let taken = arm.ports().command;
    let error = try_start(taken).unwrap_err();
    assert!(matches!(error, ArmStartError::PortInUse { port, .. } if port == taken));
    assert!(error.to_string().contains("choose another port"), "{error}");
    // Stopping frees it.
    arm.stop();
    try_start(taken).unwrap();
}
