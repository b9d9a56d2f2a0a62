//! Every fault of the script at the simulated arm's edge, in virtual time:
//! what a client gets, and what the joints do.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::float_cmp,
    reason = "tests may fail loudly"
)]

use hil_tests::arm::{
    ArmConfig, ArmEndpoint, ArmEvent, Closing, ConnectRefused, FaultScript, Firmware, Obstacle,
    ReportKind, Service, TimedEvent,
};
use rt_controller::xarm::frame::{MAX_FRAME_LEN, emit_command};
use rt_controller::xarm::report::{RealtimeReport, RichReport};
use rt_controller::xarm::{
    Command, ErrorCode, FrameReader, Mode, Protocol, StateRequest, Status, TcpPose,
};
use shared_types::{JointState, JointVector, MonotonicNs};

const START: MonotonicNs = MonotonicNs(7_000_000_000);
const CYCLE_S: f64 = 0.004;

/// A reply as it came: time since the start (ms), transaction, register, status.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Seen {
    ms: u64,
    transaction: u16,
    register: u8,
    status: u8,
}

/// An arm in virtual time with a client of the command port.
struct Bench {
    arm: ArmEndpoint,
    now: MonotonicNs,
    client: u32,
    transaction: u16,
    replies: Vec<Seen>,
    events: Vec<TimedEvent>,
    q: JointVector,
}

impl Bench {
    fn new(script: &str) -> Self {
        Self::with(script, ArmConfig::default())
    }

    fn with(script: &str, config: ArmConfig) -> Self {
        let q = config.initial_q;
        let config = ArmConfig {
            faults: script.parse::<FaultScript>().unwrap(),
            ..config
        };
        let mut arm = ArmEndpoint::new(config, START);
        let client = arm.connect(Service::Commands, START).unwrap();
        Self {
            arm,
            now: START,
            client,
            transaction: 0,
            replies: Vec::new(),
            events: Vec::new(),
            q,
        }
    }

    fn send(&mut self, command: &Command) {
        self.transaction += 1;
        let mut out = [0; MAX_FRAME_LEN];
        let n = emit_command(&mut out, self.transaction, Protocol::Private, command).unwrap();
        self.arm.receive(self.client, self.now, &out[..n]);
        self.take_replies();
    }

    fn take_replies(&mut self) {
        while let Some(bytes) = self.arm.take_frame(self.client, self.now) {
            let mut reader = FrameReader::new();
            reader.feed(&bytes);
            let reply = reader.next_frame().unwrap().unwrap().as_reply().unwrap();
            self.replies.push(Seen {
                ms: (self.now.0 - START.0) / 1_000_000,
                transaction: reply.transaction,
                register: reply.register,
                status: reply.status.0,
            });
        }
        self.events.extend(self.arm.take_events());
    }

    /// Millisecond by millisecond.
    fn wait(&mut self, span_s: f64) {
        let until = self.now.plus_s(span_s);
        while self.now < until {
            self.now = self.now.plus_s(1e-3).min(until);
            self.arm.advance_to(self.now, |_| ());
            self.take_replies();
        }
    }

    fn bring_up(&mut self, mode: Mode) {
        for command in [
            Command::CleanError,
            Command::MotionEnable {
                joint: Command::ALL_JOINTS,
                enable: true,
            },
            Command::SetMode(mode),
            Command::SetState(StateRequest::Ready),
        ] {
            self.send(&command);
        }
    }

    /// Streams joint 7 for `span_s`.
    fn stream(&mut self, speed_rad_s: f64, span_s: f64) {
        for _ in 0..(span_s / CYCLE_S).round() as usize {
            self.q[6] += speed_rad_s * CYCLE_S;
            self.send(&Command::ServoJoint(self.q));
            self.wait(CYCLE_S);
        }
    }

    fn truth(&self) -> JointState {
        self.arm.model().true_motion()
    }

    fn errors(&self) -> Vec<u8> {
        let error = |e: &TimedEvent| match e.event {
            ArmEvent::Error(ErrorCode(code)) => Some(code),
            _ => None,
        };
        self.events.iter().filter_map(error).collect()
    }

    /// When the faults began and ended, since the start (ms).
    fn fault_times(&self) -> Vec<(u64, bool)> {
        let times = |e: &TimedEvent| match e.event {
            ArmEvent::Fault { begins, .. } => Some(((e.at.0 - START.0) / 1_000_000, begins)),
            _ => None,
        };
        self.events.iter().filter_map(times).collect()
    }
}

fn entry(on: &str, rest: &str) -> String {
    format!("[[fault]]\n{on}\n{rest}\n")
}

#[test]
fn a_stall_freezes_the_arm_and_then_lets_everything_go_at_once() {
    let script = entry(
        "on = \"setpoint:50\"",
        "kind = \"stall\"\nduration_s = 0.19",
    );
    let mut b = Bench::new(&script);
    b.bring_up(Mode::Servo);
    b.replies.clear();
    b.stream(0.5, 1.0);
    assert_eq!(b.replies.len(), 250);
    let [(begins, true), (ends, false)] = b.fault_times()[..] else {
        panic!("{:?}", b.fault_times());
    };
    assert_eq!(ends - begins, 190);
    let burst = b.replies.iter().filter(|r| r.ms == ends).count();
    assert!((47..=49).contains(&burst), "{burst}");
    assert!(!b.replies.iter().any(|r| (begins..ends).contains(&r.ms)));
    // Only the newest of the burst counts.
    let counters = b.arm.model().counters();
    assert!((46..=48).contains(&counters.dropped), "{counters:?}");
    b.wait(0.3);
    assert!((b.truth().q[6] - 0.5).abs() < 1e-6);
    assert_eq!(b.errors(), [0; 0]);
}

#[test]
fn resets_half_open_links_and_pulled_cables_differ_for_the_client() {
    // A reset: the connection ends, a new one works.
    let mut b = Bench::new(&entry(
        "on = \"setpoint:10\"",
        "kind = \"connection_reset\"",
    ));
    b.bring_up(Mode::Servo);
    b.replies.clear();
    b.stream(0.1, 0.1);
    assert_eq!(b.replies.len(), 9);
    assert_eq!(b.arm.closing(b.client), Some(Closing::Reset));
    b.client = b.arm.connect(Service::Commands, b.now).unwrap();
    b.send(&Command::GetState);
    assert_eq!(b.replies.len(), 10);

    // Half open: it stays, but nothing comes any more.
    let mut b = Bench::new(&entry("on = \"setpoint:10\"", "kind = \"half_open\""));
    b.bring_up(Mode::Servo);
    b.replies.clear();
    b.stream(0.1, 0.1);
    assert_eq!((b.replies.len(), b.arm.closing(b.client)), (9, None));
    assert!(!b.arm.receive(b.client, b.now, &[0; 3]));
    b.client = b.arm.connect(Service::Commands, b.now).unwrap();
    b.send(&Command::GetState);
    assert_eq!(b.replies.len(), 10);

    // A pulled cable: silence everywhere, no new connection, then a reset.
    let script = entry(
        "on = \"setpoint:10\"",
        "kind = \"cable_pull\"\nduration_s = 0.5",
    );
    let mut b = Bench::new(&script);
    let reports = b
        .arm
        .connect(Service::Reports(ReportKind::Realtime), b.now)
        .unwrap();
    b.bring_up(Mode::Servo);
    b.replies.clear();
    b.stream(0.1, 0.1);
    while b.arm.take_frame(reports, b.now).is_some() {}
    b.wait(0.3);
    assert_eq!((b.replies.len(), b.arm.closing(b.client)), (9, None));
    assert!(b.arm.take_frame(reports, b.now).is_none());
    let refused = b.arm.connect(Service::Commands, b.now);
    assert_eq!(refused, Err(ConnectRefused::Unreachable));
    b.wait(0.2);
    for client in [b.client, reports] {
        assert_eq!(b.arm.closing(client), Some(Closing::Reset));
    }
    assert!(b.arm.connect(Service::Commands, b.now).is_ok());
}

#[test]
fn replies_come_late_swapped_twice_or_not_at_all() {
    let run = |kind: &str| {
        let mut b = Bench::new(&entry("at_s = 0.1", kind));
        b.wait(0.2);
        for _ in 0..40 {
            b.send(&Command::GetState);
            b.wait(CYCLE_S);
        }
        b.wait(0.1);
        let ids: Vec<_> = b.replies.iter().map(|r| r.transaction).collect();
        (ids, b.replies[0].ms)
    };
    let in_order: Vec<u16> = (1..=40).collect();
    let (ids, first_ms) = run("kind = \"replies_delayed\"\ndelay_s = 0.02");
    assert_eq!((ids, first_ms), (in_order.clone(), 220));
    let (ids, _) = run("kind = \"replies_reordered\"");
    assert_eq!(ids[..4], [2, 1, 4, 3]);
    let (ids, _) = run("kind = \"replies_duplicated\"");
    assert_eq!(ids[..4], [1, 1, 2, 2]);
    let (ids, _) = run("kind = \"replies_lost\"\nshare = 0.5");
    assert!((10..30).contains(&ids.len()), "{ids:?}");
    let (ids, _) = run("kind = \"replies_foreign\"");
    assert_eq!(ids[..4], [0x4001, 1, 0x4002, 2]);
}

/// A reply that waits for another one to pass does not wait for ever.
#[test]
fn a_lonely_reply_is_only_delayed_by_reordering() {
    let mut b = Bench::new(&entry("at_s = 0", "kind = \"replies_reordered\""));
    b.wait(0.01);
    b.send(&Command::GetState);
    b.wait(0.1);
    assert_eq!(b.replies.len(), 1);
    assert!((30..=33).contains(&b.replies[0].ms), "{:?}", b.replies);
}

#[test]
fn status_bits_lie_without_anything_else_changing() {
    for (kind, bit) in [
        ("error_bit", Status::ERROR),
        ("warning_bit", Status::WARNING),
        ("not_ready_bit", Status::NOT_READY),
    ] {
        let script = entry(
            "on = \"setpoint:5\"",
            &format!("kind = \"{kind}\"\nduration_s = 0.02"),
        );
        let mut b = Bench::new(&script);
        b.bring_up(Mode::Servo);
        b.replies.clear();
        b.stream(0.2, 0.1);
        let lies = b.replies.iter().filter(|r| r.status == bit).count();
        assert!((5..=6).contains(&lies), "{kind}: {lies}");
        assert_eq!(b.arm.model().counters().motion_commands, 25);
    }
}

#[test]
fn errors_stops_and_drives_latch_as_on_the_real_arm() {
    let mut b = Bench::new(&entry(
        "on = \"setpoint:20\"",
        "kind = \"raise_error\"\ncode = 60",
    ));
    b.bring_up(Mode::Servo);
    b.stream(0.2, 0.2);
    assert_eq!(b.errors(), [60]);
    assert!(Status(b.replies.last().unwrap().status).has_error());
    b.bring_up(Mode::Servo);
    b.q = b.arm.model().reference_motion().q;
    b.stream(0.2, 0.1);
    assert!(Status(b.replies.last().unwrap().status).accepts_motion());

    // A pressed button cannot be cleared away.
    let mut b = Bench::new(&entry(
        "at_s = 0.1",
        "kind = \"emergency_stop\"\ncode = 2\nduration_s = 1",
    ));
    b.wait(0.5);
    b.bring_up(Mode::Servo);
    assert!(Status(b.replies.last().unwrap().status).has_error());
    b.wait(0.7);
    b.bring_up(Mode::Servo);
    assert_eq!(b.replies.last().unwrap().status, 0);

    // Nor can a broken drive, until power was off.
    let script = entry("at_s = 0.1", "kind = \"servo_error\"\njoint = 3\ncode = 23")
        + &entry("at_s = 1", "kind = \"power_cycle\"\nduration_s = 0.5");
    let mut b = Bench::new(&script);
    b.wait(0.5);
    assert_eq!(b.errors(), [13]);
    b.bring_up(Mode::Servo);
    assert!(Status(b.replies.last().unwrap().status).has_error());
    b.wait(0.6);
    assert_eq!(
        b.arm.connect(Service::Commands, b.now),
        Err(ConnectRefused::Unreachable)
    );
    b.wait(0.6);
    b.client = b.arm.connect(Service::Commands, b.now).unwrap();
    // The controller's clock began anew.
    assert!(b.arm.model().time_us() < 300_000);
    b.bring_up(Mode::Servo);
    assert_eq!(b.replies.last().unwrap().status, 0);
}

#[test]
fn warnings_states_and_modes_change_by_themselves() {
    for (kind, want) in [
        ("kind = \"state_changed\"\nstate = 4", Status::NOT_READY),
        ("kind = \"mode_changed\"\nmode = 0", Status::NOT_READY),
        ("kind = \"warning\"\ncode = 11", Status::WARNING),
        ("kind = \"collision\"", Status::ERROR | Status::NOT_READY),
    ] {
        let mut b = Bench::new(&entry("on = \"setpoint:10\"", kind));
        b.bring_up(Mode::Servo);
        b.stream(0.2, 0.1);
        assert_eq!(b.replies.last().unwrap().status, want, "{kind}");
    }
}

#[test]
fn a_second_commander_moves_stops_or_takes_the_arm_away() {
    let run = |wish: &str| {
        let script = entry(
            "on = \"setpoint:10\"",
            &format!(
                "kind = \"second_commander\"\nwish = \"{wish}\"\nrate_hz = 50\nduration_s = 0.1"
            ),
        );
        let mut b = Bench::new(&script);
        b.bring_up(Mode::Servo);
        b.stream(0.0, 0.3);
        b
    };
    let b = run("setpoints");
    let foreign: Vec<_> = b
        .events
        .iter()
        .filter(|e| e.client == Some(u32::MAX))
        .collect();
    assert!((5..=6).contains(&foreign.len()), "{foreign:?}");
    assert!(
        b.arm.model().reference_motion().q[6].abs() < 1e-9,
        "ours is newest"
    );
    for wish in ["stop", "mode"] {
        let b = run(wish);
        assert!(Status(b.replies.last().unwrap().status).is_not_ready());
    }
}

/// Real-time reports of a run with a fault at 0.5 s, as bytes, by arrival (ms).
fn reports(kind: &str) -> Vec<(u64, Vec<u8>)> {
    let mut b = Bench::new(&entry("at_s = 0.5", kind));
    let client = b
        .arm
        .connect(Service::Reports(ReportKind::Realtime), b.now)
        .unwrap();
    b.bring_up(Mode::Servo);
    let mut seen = Vec::new();
    for _ in 0..250 {
        b.stream(0.3, CYCLE_S);
        while let Some(frame) = b.arm.take_frame(client, b.now) {
            seen.push(((b.now.0 - START.0) / 1_000_000, frame));
        }
    }
    seen
}

#[test]
fn report_streams_stop_freeze_and_show_wrong_times() {
    let healthy = reports("kind = \"collision\"");
    assert!(healthy.len() >= 249 && healthy.iter().all(|(_, f)| f.len() == 784));

    let stopped = reports("kind = \"report_stop\"\nduration_s = 0.3");
    assert!((173..=177).contains(&stopped.len()), "{}", stopped.len());

    let parse = |frames: &[(u64, Vec<u8>)]| -> Vec<RealtimeReport> {
        let parse = |(_, f): &(u64, Vec<u8>)| RealtimeReport::parse(f).unwrap();
        frames.iter().map(parse).collect()
    };
    let frozen = parse(&reports("kind = \"report_freeze\"\nduration_s = 0.3"));
    let same = frozen
        .windows(2)
        .filter(|w| w[0].actual == w[1].actual && w[1].time_us > w[0].time_us)
        .count();
    assert!((74..=85).contains(&same), "{same}");

    let steps = |kind: &str| -> Vec<i64> {
        parse(&reports(kind))
            .windows(2)
            .map(|w| w[1].time_us.cast_signed() - w[0].time_us.cast_signed())
            .collect()
    };
    let jump = steps("kind = \"report_time_jump\"\nby_s = -0.5");
    assert_eq!(jump.iter().filter(|s| **s == -496_000).count(), 1);
    let wrap = steps("kind = \"report_time_wrap\"");
    assert_eq!(wrap.iter().filter(|s| **s < -100_000_000).count(), 1);
    let drift: i64 = steps("kind = \"report_time_drift\"\nppm = 10000")
        .iter()
        .sum();
    assert!((drift - 1_005_000).abs() < 3_000, "{drift}");
}

#[test]
fn spoiled_reports_are_torn_mislabelled_or_no_numbers() {
    let count =
        |kind: &str, is: fn(&[u8]) -> bool| reports(kind).iter().filter(|(_, f)| is(f)).count();
    let torn = "kind = \"report_torn\"\nframes = 3\nkeep_bytes = 60";
    assert_eq!(count(torn, |f| f.len() == 60), 3);
    let length = "kind = \"report_length\"\nframes = 2\nclaim_bytes = 12";
    assert_eq!(count(length, |f| f[..4] == [0, 0, 0, 12]), 2);
    fn second(f: &[u8]) -> f64 {
        RealtimeReport::parse(f).unwrap().actual.q[1]
    }
    let nan = "kind = \"report_nan\"\nframes = 4\njoint = 2";
    assert_eq!(count(nan, |f| second(f).is_nan()), 4);
    let infinity = "kind = \"report_infinity\"\nframes = 4\njoint = 2";
    assert_eq!(count(infinity, |f| second(f).is_infinite()), 4);
    // A proper stamp is far below a day.
    let day_us = |f: &[u8]| RealtimeReport::parse(f).unwrap().time_us > 86_400_000_000;
    let garbage = "kind = \"report_garbage\"\nframes = 5";
    assert_eq!(count(garbage, day_us), 5);
}

#[test]
fn joints_lag_stick_and_lie() {
    let run = |kind: &str| {
        let mut b = Bench::new(&entry("at_s = 0.5", kind));
        b.bring_up(Mode::Servo);
        b.stream(0.5, 1.0);
        let asked = b.q[6];
        let model = b.arm.model();
        (
            asked - model.true_motion().q[6],
            asked - model.measured_motion().q[6],
        )
    };
    // 0.5 rad/s behind by about 20 ms, or by 100 ms more.
    let (healthy, _) = run("kind = \"collision\"\n");
    assert!(healthy > 0.2, "a collision stops the arm: {healthy}");
    let (late, _) = run("kind = \"tracking_lag\"\nlag_s = 0.1");
    assert!((0.055..0.065).contains(&late), "{late}");
    let (stuck, _) = run("kind = \"joint_stuck\"\njoint = 7");
    assert!((0.24..0.28).contains(&stuck), "{stuck}");
    let (truth, seen) = run("kind = \"encoder_jump\"\njoint = 7\nby_rad = 0.0873");
    assert!((truth - seen - 0.0873).abs() < 2e-5);
}

/// 0.1 % off over 20 s: the stream still moves evenly, and what its own clock
/// makes the controller lose or repeat is counted.
#[test]
fn a_clock_off_by_a_thousandth_is_counted() {
    let config = || ArmConfig {
        intake: hil_tests::arm::Intake::Clock,
        ..ArmConfig::default()
    };
    let run = |ppm: f64| {
        let script = entry("at_s = 0", &format!("kind = \"clock_rate\"\nppm = {ppm}"));
        let mut b = Bench::with(&script, config());
        let uptime_us = b.arm.model().time_us();
        b.wait(0.01);
        b.bring_up(Mode::Servo);
        b.stream(0.1, 20.0);
        let span_us = b.arm.model().time_us() - uptime_us;
        (b.arm.model().counters(), span_us)
    };
    let (slow, span_us) = run(-1000.0);
    assert!(span_us.abs_diff(19_990_000) < 30, "{span_us}");
    assert!(
        (4..=6).contains(&slow.dropped) && slow.repeated <= 1,
        "{slow:?}"
    );
    let (fast, _) = run(1000.0);
    assert!(
        (4..=6).contains(&fast.repeated) && fast.dropped <= 1,
        "{fast:?}"
    );
}

#[test]
fn firmware_decides_layouts_and_what_is_known() {
    let config = |firmware| ArmConfig {
        firmware,
        ..ArmConfig::default()
    };
    let sizes = |firmware| {
        let mut b = Bench::with("", config(firmware));
        ReportKind::ALL.map(|kind| {
            let client = b.arm.connect(Service::Reports(kind), b.now).ok()?;
            b.arm.take_frame(client, b.now).map(|frame| frame.len())
        })
    };
    let of = |realtime, rich| [realtime, Some(145), Some(rich), Some(135)];
    assert_eq!(sizes(Firmware(2, 7, 1)), of(Some(784), 574));
    assert_eq!(sizes(Firmware(2, 8, 2)), of(Some(804), 587));
    assert_eq!(sizes(Firmware(1, 12, 10)), of(None, 417));

    let factor = |firmware| {
        let mut b = Bench::with("", config(firmware));
        b.send(&Command::GetSpeedLimitFactor);
        Status(b.replies[0].status).is_invalid()
    };
    assert!(factor(Firmware(2, 2, 0)) && !factor(Firmware(2, 3, 0)));

    // A change concerns new connections; the old ones keep their size.
    let mut b = Bench::new(&entry(
        "at_s = 0.1",
        "kind = \"firmware_changed\"\nversion = \"2.8.2\"",
    ));
    let rich = |b: &mut Bench| {
        b.arm
            .connect(Service::Reports(ReportKind::Rich), b.now)
            .unwrap()
    };
    let old = rich(&mut b);
    b.wait(0.3);
    let new = rich(&mut b);
    let len = |b: &mut Bench, client| {
        let mut last = 0;
        while let Some(frame) = b.arm.take_frame(client, b.now) {
            last = frame.len();
            let report = RichReport::parse(&frame).unwrap();
            assert!(report.firmware.starts_with(b"v2."));
        }
        last
    };
    assert_eq!((len(&mut b, old), len(&mut b, new)), (574, 587));
}

/// The pole tip swings into a wall; the safety boundary stops it before.
#[test]
fn obstacles_raise_c31_and_the_boundary_c35() {
    let pose = JointVector([0.0, 0.3, 0.0, 1.0, 0.0, 0.7, 0.0]);
    let offset = Command::TcpOffset(TcpPose {
        position_m: [0.0, 0.0, 0.2],
        rpy_rad: [0.0; 3],
    });
    let wall = Obstacle::Plane {
        point_m: [0.0, 0.2, 0.0],
        normal: [0.0, -1.0, 0.0],
    };
    let run = |obstacles: Vec<Obstacle>, fence: bool| {
        let config = ArmConfig {
            obstacles,
            initial_q: pose,
            ..ArmConfig::default()
        };
        let mut b = Bench::with("", config);
        b.send(&offset);
        if fence {
            // Registers 52 and 59: y at most 20 mm.
            let sides: [i32; 6] = [2000, -2000, 20, -2000, 2000, -2000];
            let bytes: Vec<u8> = sides.iter().flat_map(|mm| mm.to_le_bytes()).collect();
            let mut frame = vec![0, 1, 0, 2, 0, 25, 0x34];
            frame.extend(bytes);
            frame.extend([0, 2, 0, 2, 0, 2, 0x3B, 1]);
            b.arm.receive(b.client, b.now, &frame);
        }
        b.bring_up(Mode::Servo);
        for _ in 0..400 {
            b.q[0] += 0.4 * CYCLE_S;
            b.send(&Command::ServoJoint(b.q));
            b.wait(CYCLE_S);
        }
        b.errors()
    };
    assert_eq!(run(vec![], false), [0; 0]);
    assert_eq!(run(vec![wall], false), [31]);
    assert_eq!(run(vec![wall], true), [35]);
}

/// A client that asks for it is told about the beginning and end of its moves.
#[test]
fn feedback_is_pushed_when_asked_for() {
    let mut b = Bench::new("");
    b.bring_up(Mode::Position);
    b.send(&Command::FeedbackMask(3));
    let mut target = JointVector::ZERO;
    target[6] = 0.1;
    b.replies.clear();
    b.send(&Command::MoveJoint {
        target,
        speed_rad_s: 1.0,
        acceleration_rad_s2: 10.0,
        checked: None,
    });
    let asked = b.transaction;
    b.wait(1.0);
    let pushes: Vec<_> = b.replies.iter().filter(|r| r.register == 0xFF).collect();
    assert_eq!(pushes.len(), 2, "{:?}", b.replies);
    assert!(pushes.iter().all(|p| p.transaction == asked));
}
