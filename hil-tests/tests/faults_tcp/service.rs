//! What the controller's service answers, mode by mode.

use super::stand::{Stand, arm_for, execute, swing};
use arm_model::joint::START_POSE;
use arm_model::{Limits, LimitsSpec};
use rt_controller::commander::CommanderLock;
use shared_types::ipc::ControllerMode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::{FaultCode, OperatingMode};
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
    for early in [move_to(aside), arm_for(OperatingMode::SetUp, false)] {
        assert_eq!(stand.refused(&early).0, FaultCode::WrongMode);
    }
    stand.make_ready();
    let throw = execute(&swing(START_POSE));
    for unarmed in [throw.clone(), arm_for(OperatingMode::Throw, false)] {
        assert_eq!(stand.refused(&unarmed).0, FaultCode::NotArmed);
    }

    let armed = arm_for(OperatingMode::SetUp, false);
    assert_eq!(stand.ask(&armed), ControllerEvent::Done);
    match stand.ask(&ControllerRequest::Status) {
        ControllerEvent::Status { operating_mode, .. } => {
            assert_eq!(operating_mode, Some(OperatingMode::SetUp));
        }
        other => panic!("{other:?}"),
    }
    for pose in [aside, START_POSE] {
        let pending = stand.call(&move_to(pose));
        stand.finishes(&pending);
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
    let mut stand = Stand::with("refusals", ArmConfig::default(), |config| {
        let mut spec = LimitsSpec::from(Limits::default());
        spec.tcp_speed_max_m_s = 1.0;
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
        message.contains("1.200") && message.contains("1.000"),
        "{message}"
    );
    stand.finish();
}
