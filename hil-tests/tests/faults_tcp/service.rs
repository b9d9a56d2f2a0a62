//! What the controller's service answers, mode by mode.

use super::stand::{PATIENCE, Stand, arm_for, execute, swing};
use arm_model::joint::START_POSE;
use arm_model::{JointTrajectory, Limits, LimitsSpec};
use hil_tests::scenario::entry;
use rt_controller::arm_settings::Load;
use rt_controller::commander::CommanderLock;
use rt_controller::config::OnDifference;
use rt_controller::xarm::report::{NormalReport, RICH_REPORT_LEN};
use rt_controller::xarm::{Command, Mode, ReplyData};
use shared_types::ipc::ControllerMode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::{FaultCode, OperatingMode};
use std::io::Read;
use std::net::TcpStream;
use xarm_sim::ArmConfig;

#[test]
fn motions_need_a_bring_up_and_an_arming_and_a_throw_is_armed_once() {
    let mut stand = Stand::start("armed");
    let mut aside = START_POSE;
    aside[0] += 0.1;
    // Slow enough for setting up: 0.2 m/s at the pole's end.
    let move_to = |q| ControllerRequest::MoveTo {
        q,
        speed_fraction: 0.1,
    };
    for early in [move_to(aside), arm_for(OperatingMode::SetUp, None)] {
        assert_eq!(stand.refused(&early).0, FaultCode::WrongMode);
    }
    stand.make_ready();
    let throw = execute(&swing(START_POSE));
    for unarmed in [throw.clone(), arm_for(OperatingMode::Throw, None)] {
        assert_eq!(stand.refused(&unarmed).0, FaultCode::NotArmed);
    }

    let armed = arm_for(OperatingMode::SetUp, None);
    assert_eq!(stand.ask(&armed), ControllerEvent::Done);
    match stand.ask(&ControllerRequest::Status) {
        ControllerEvent::Status { operating_mode, .. } => {
            assert_eq!(operating_mode, Some(OperatingMode::SetUp));
        }
        other => panic!("{other:?}"),
    }
    for pose in [aside, START_POSE] {
        stand.moves(&move_to(pose));
        assert!((stand.commanded() - pose).max_abs() < 1e-6);
    }
    assert_eq!(stand.ask(&ControllerRequest::Disarm), ControllerEvent::Done);
    assert_eq!(stand.refused(&throw).0, FaultCode::NotArmed);

    let [start_ns, end_ns] = stand.throws();
    let lasted_s = (end_ns - start_ns) as f64 * 1e-9;
    assert!((2.4..4.0).contains(&lasted_s), "{lasted_s}");
    assert_eq!(stand.refused(&throw).0, FaultCode::NotArmed);
    match stand.ask(&ControllerRequest::Latency) {
        ControllerEvent::Latency(report) => {
            assert!(
                report.cycles > 200 && report.reply.count > 100,
                "{report:?}"
            );
        }
        other => panic!("{other:?}"),
    }
    stand.finish();
}

/// Both hear of it: who asked for the stop and who asked for the motion.
#[test]
fn a_stop_is_served_while_a_trajectory_runs() {
    let mut stand = Stand::ready("served");
    let pending = stand.begin();
    stand.wait_for_speed();
    assert_eq!(stand.ask(&ControllerRequest::Stop), ControllerEvent::Done);
    stand.stops(&pending, &[FaultCode::OperatorStop]);
    let answer = stand.ask(&ControllerRequest::Acknowledge);
    assert_eq!(answer, ControllerEvent::Done);
    assert_eq!(stand.mode(), ControllerMode::Idle);
    stand.recovers();
}

#[test]
fn another_commander_or_another_tool_speed_is_a_refusal_that_says_what() {
    for (configured_m_s, expected) in [(0.7, "0.700 to 1.050"), (1.3, "1.300 to 1.950")] {
        let mut stand = Stand::with("refusals", ArmConfig::default(), |config| {
            let mut spec = LimitsSpec::from(Limits::default());
            spec.tcp_speed_max_m_s = configured_m_s;
            config.limits = Some(spec.try_into().unwrap());
        });
        let arm = (stand.config.arm, stand.config.command_port).into();
        let lock = CommanderLock::take(arm).unwrap();
        let (fault, message) = stand.refused(&ControllerRequest::Bringup);
        assert_eq!(fault, FaultCode::SecondCommander);
        let me = format!("process {}", std::process::id());
        assert!(message.contains(&me), "{message}");
        drop(lock);
        let (fault, message) = stand.refused(&ControllerRequest::Bringup);
        assert_eq!(fault, FaultCode::ArmDiffers);
        assert!(
            message.contains("1.200") && message.contains(expected),
            "{message}"
        );
        stand.finish();
    }
}

/// The loop would brake it on its way.
#[test]
fn a_motion_faster_than_it_is_armed_for_is_refused_before_it_begins() {
    let mut stand = Stand::ready("armed_speed");
    let mut aside = START_POSE;
    aside[0] += 0.6;
    let there_and_back = [START_POSE, aside, START_POSE];
    let swung = execute(&JointTrajectory::new(&[0.0, 0.8, 1.6], &there_and_back).unwrap());
    // About joint 6 the pole's end is 2.5 times as fast as the flange: 0.46 m/s.
    let mut turned = START_POSE;
    turned[5] -= 0.5;
    let times = [0.0, 0.5, 1.0];
    let pole = JointTrajectory::new(&times, &[START_POSE, turned, START_POSE]).unwrap();
    let pole = execute(&pole);
    for (armed, request) in [
        (OperatingMode::SetUp, &swung),
        (OperatingMode::Wiggle, &swung),
        (OperatingMode::SetUp, &pole),
    ] {
        assert_eq!(stand.arm_for(armed), ControllerEvent::Done);
        let (fault, message) = stand.refused(request);
        assert_eq!(fault, FaultCode::OperatingModeExceeded, "{message}");
        assert!(
            message.contains(&format!("armed for {armed:?}")),
            "{message}"
        );
        assert_eq!(stand.mode(), ControllerMode::Idle);
    }
    assert_eq!(stand.arm_for(OperatingMode::Throw), ControllerEvent::Done);
    stand.moves(&swung);
    stand.finish();
}

/// A setpoint 0.2 ms late looks 5 % too fast, so the arm's limit is above that of the plans.
#[test]
fn the_arms_own_speed_limit_has_headroom_or_is_set() {
    for (configured_m_s, on_difference, factor, warns) in [
        (1.0, OnDifference::Refuse, 1.2, false),
        // Left as it is.
        (1.2, OnDifference::Refuse, 1.2, true),
        (1.0, OnDifference::Set, 1.2, false),
        (0.7, OnDifference::Set, 0.77, false),
        (1.2, OnDifference::Set, 1.32, false),
    ] {
        let mut stand = Stand::ready_with("headroom", |config| {
            let mut spec = LimitsSpec::from(Limits::default());
            spec.tcp_speed_max_m_s = configured_m_s;
            config.limits = Some(spec.try_into().unwrap());
            config.on_difference = on_difference;
        });
        let mut other = stand.other_client();
        let found = match other.ask(&Command::GetSpeedLimitFactor).unwrap() {
            ReplyData::SpeedLimitFactor(found) => found,
            other => panic!("{other:?}"),
        };
        assert!((found - factor).abs() < 1e-3, "{configured_m_s}: {found}");
        match stand.ask(&ControllerRequest::Status) {
            ControllerEvent::Status { warnings, .. } => {
                let warned = warnings.iter().any(|w| w.contains("C60"));
                assert_eq!(warned, warns, "{warnings:?}");
            }
            other => panic!("{other:?}"),
        }
        stand.finish();
    }
}

/// Other programs and a reset change the arm's settings; nothing says so later.
#[test]
fn an_arm_set_otherwise_than_configured_is_refused_or_set() {
    let change = |stand: &Stand, command| {
        stand.other_client().ask(&command).unwrap();
    };
    let load = |mass_kg| Command::TcpLoad {
        mass_kg,
        centre_m: [0.0, 0.0, 0.1],
    };
    let mut stand = Stand::with("settings", ArmConfig::default(), |config| {
        config.arm_settings.load = Some(Load {
            mass_kg: 0.3,
            centre_m: [0.0, 0.0, 0.1],
        });
    });
    change(&stand, load(0.3));
    for (command, words) in [
        (Command::CollisionSensitivity(0), "sensitivity 0"),
        (load(0.0), "a load of 0.000 kg"),
    ] {
        change(&stand, command);
        let (fault, message) = stand.refused(&ControllerRequest::Bringup);
        assert_eq!(fault, FaultCode::ArmDiffers, "{message}");
        assert!(message.contains(words), "{message}");
        change(&stand, Command::CollisionSensitivity(3));
    }
    change(&stand, load(0.3));
    stand.make_ready();
    stand.finish();

    let stand = Stand::ready_with("settings_set", |config| {
        config.on_difference = OnDifference::Set;
        config.arm_settings.load = Some(Load {
            mass_kg: 0.5,
            centre_m: [0.0, 0.0, 0.08],
        });
        config.arm_settings.collision_sensitivity = Some(4);
    });
    let mut port = TcpStream::connect((stand.config.arm, stand.config.status_ports[0])).unwrap();
    port.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut report = [0; RICH_REPORT_LEN];
    port.read_exact(&mut report).unwrap();
    let found = NormalReport::parse(&report).unwrap();
    assert!((found.load_kg - 0.5).abs() < 1e-9, "{found:?}");
    assert!((found.load_centre_m[2] - 0.08).abs() < 1e-6, "{found:?}");
    assert_eq!(found.collision_sensitivity, 4);
    stand.finish();
}

/// Each bring-up that held the measured pose would let a drooping joint down further.
#[test]
fn an_arm_that_droops_is_held_as_commanded_and_one_that_is_elsewhere_where_it_stands() {
    for (droop_rad, follows) in [(0.001, false), (0.02, true)] {
        let droop = format!("encoder_jump, joint = 2, by_rad = {droop_rad}");
        let arm = ArmConfig {
            faults: entry("at_s = 0.0", &droop).parse().unwrap(),
            ..ArmConfig::default()
        };
        let mut stand = Stand::with("droop", arm, |_| ());
        stand.make_ready();
        let off_rad = stand.commanded()[1] - START_POSE[1];
        let expected_rad = if follows { droop_rad } else { 0.0 };
        assert!((off_rad - expected_rad).abs() < 1e-4, "{off_rad}");
        stand.finish();
    }
}

/// For a third of a second the reports of an arm say nothing of the mode that it was brought
/// into; until then nothing is armed or moves.
#[test]
fn a_bring_up_is_done_when_the_arms_reports_count() {
    const LEFT: [FaultCode; 2] = [FaultCode::ArmModeChanged, FaultCode::ArmNotReady];
    let mut stand = Stand::start("settles");
    let bring_up = stand.call(&ControllerRequest::Bringup);
    stand.wait_until("the engagement", |s| s.mode() == ControllerMode::Idle);
    let early = [
        arm_for(OperatingMode::SetUp, None),
        ControllerRequest::MoveTo {
            q: START_POSE,
            speed_fraction: 0.1,
        },
    ];
    let early = early.map(|request| stand.call(&request));
    for pending in early {
        let (fault, message) = stand.refuses(&pending);
        assert_eq!(fault, FaultCode::WrongMode);
        assert!(message.contains("bring-up is under way"), "{message}");
    }
    // Somebody takes the arm out of its mode before anything could tell.
    let mut other = stand.other_client();
    other.ask(&Command::SetMode(Mode::Position)).unwrap();
    // Replies to setpoints may tell it before the reports do.
    let (fault, message) = stand.refuses(&bring_up);
    assert!(LEFT.contains(&fault), "{fault:?}: {message}");
    stand.expect(&LEFT);
    stand.finish();
}

/// A move is as fast as it is armed for at most, whatever was asked for.
#[test]
fn the_poles_end_keeps_the_speed_that_a_move_is_armed_for() {
    for (armed, most_m_s) in [(OperatingMode::SetUp, 0.25), (OperatingMode::Throw, 1.0)] {
        let mut stand = Stand::ready("pole_speed");
        let mut turned = START_POSE;
        (turned[0], turned[5]) = (turned[0] + 0.5, turned[5] - 0.9);
        assert_eq!(stand.arm_for(armed), ControllerEvent::Done);
        stand.moves(&ControllerRequest::MoveTo {
            q: turned,
            speed_fraction: 1.0,
        });
        let pole = stand.config.pole;
        let top_m_s = stand.finish().pole_top_m_s(&pole);
        assert!(
            (0.7 * most_m_s..1.01 * most_m_s).contains(&top_m_s),
            "{armed:?}: {top_m_s} m/s"
        );
    }
}
