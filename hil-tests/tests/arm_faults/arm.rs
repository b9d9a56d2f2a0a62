//! What goes wrong with the arm itself.

use super::scenario::{CYCLE_S, Scenario};
use arm_model::{JointVector, Pole};
use hil_tests::scenario::entry;
use rt_controller::xarm::{Command, Mode, Status, TcpPose};
use xarm_sim::{ArmConfig, ConnectRefused, Obstacle, Service};

#[test]
fn stops_and_drives_latch_as_on_the_real_arm() {
    // A pressed button cannot be cleared away.
    let mut b = Scenario::new(&entry(
        "at_s = 0.1",
        "emergency_stop, code = 2, duration_s = 1",
    ));
    b.wait(0.5);
    b.bring_up(Mode::Servo);
    assert!(b.status().has_error());
    b.wait(0.7);
    b.bring_up(Mode::Servo);
    assert_eq!(b.status(), Status(0));

    // Nor can a broken drive, until power was off.
    let script = entry("at_s = 0.1", "servo_error, joint = 3, code = 23")
        + &entry("at_s = 1", "power_cycle, duration_s = 0.5");
    let mut b = Scenario::new(&script);
    b.wait(0.5);
    assert_eq!(b.errors(), [13]);
    b.bring_up(Mode::Servo);
    assert!(b.status().has_error());
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
    assert_eq!(b.status(), Status(0));
}

#[test]
fn warnings_states_and_modes_change_by_themselves() {
    for (kind, want) in [
        ("state_changed, state = 4", Status::NOT_READY),
        ("mode_changed, mode = 0", Status::NOT_READY),
        ("warning, code = 11", Status::WARNING),
        ("collision", Status::ERROR | Status::NOT_READY),
    ] {
        let mut b = Scenario::new(&entry("on = 'setpoint:10'", kind));
        b.bring_up(Mode::Servo);
        b.stream(0.2, 0.1);
        assert_eq!(b.status(), Status(want), "{kind}");
    }
}

#[test]
fn a_second_commander_moves_stops_or_takes_the_arm_away() {
    let run = |request: &str| {
        let script = entry(
            "on = 'setpoint:10'",
            &format!("second_commander, request = '{request}', rate_hz = 50, duration_s = 0.1"),
        );
        let mut b = Scenario::new(&script);
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
    for request in ["stop", "mode"] {
        let b = run(request);
        assert!(b.status().is_not_ready());
    }
}

#[test]
fn joints_lag_stick_and_lie() {
    let run = |kind: &str| {
        let mut b = Scenario::new(&entry("at_s = 0.5", kind));
        b.bring_up(Mode::Servo);
        b.stream(0.5, 1.0);
        let requested = b.q[6];
        let model = b.arm.model();
        (
            requested - model.true_motion().q[6],
            requested - model.measured_motion().q[6],
        )
    };
    // 0.5 rad/s behind by about 20 ms, or by 100 ms more.
    let (healthy, _) = run("collision");
    assert!(healthy > 0.2, "a collision stops the arm: {healthy}");
    let (late, _) = run("tracking_lag, lag_s = 0.1");
    assert!((0.055..0.065).contains(&late), "{late}");
    let (stuck, _) = run("joint_stuck, joint = 7");
    assert!((0.24..0.28).contains(&stuck), "{stuck}");
    let (truth, seen) = run("encoder_jump, joint = 7, by_rad = 0.0873");
    assert!((truth - seen - 0.0873).abs() < 2e-5);
}

/// 0.1 % off over 20 s: the stream still moves evenly, and what its own clock
/// makes the controller lose or repeat is counted.
#[test]
fn a_clock_off_by_a_thousandth_is_counted() {
    let config = || ArmConfig {
        intake: xarm_sim::Intake::Clock,
        ..ArmConfig::default()
    };
    let run = |ppm: f64| {
        let script = entry("at_s = 0", &format!("clock_rate, ppm = {ppm}"));
        let mut b = Scenario::with(&script, config());
        let uptime_us = b.arm.model().time_us();
        b.wait(0.01);
        b.bring_up(Mode::Servo);
        b.stream(0.1, 20.0);
        let span_us = b.arm.model().time_us() - uptime_us;
        (b.arm.model().counters(), span_us)
    };
    let (slow, span_us) = run(-1000.0);
    assert!(slow.executed + slow.dropped + 2 >= slow.motion_commands);
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

/// The pole tip swings into a wall; the safety boundary stops it before.
#[test]
fn obstacles_raise_c31_and_the_boundary_c35() {
    let pose = JointVector([0.0, 0.3, 0.0, 1.0, 0.0, 0.7, 0.0]);
    let offset = Command::TcpOffset(TcpPose {
        position_m: Pole::default().end_m().into(),
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
        let mut b = Scenario::with("", config);
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
