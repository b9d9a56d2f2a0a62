//! The operator: silent, killed, or letting go of the dead-man switch.

use super::child::{Process, Role};
use super::stand::{Stand, arm_for, execute, swing};
use rt_controller::config::EnablingInput;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::ipc::{ControllerMode, OperatorEnd};
use shared_types::{FaultCode, OperatingMode};
use std::time::Duration;
use xarm_sim::{ArmConfig, clock};

/// Works again after a stop in which it was braked in joint space and the arm left ready.
fn recovers_from_a_brake(stand: Stand) {
    let flight = stand.recovers();
    let cause = flight.causes[0];
    assert_eq!((cause.path, cause.stop_arm), (2, 0), "{cause:?}");
}

#[test]
fn fault_36_a_dead_man_switch_let_go_brakes_and_holds_until_it_is_held_again() {
    let mut stand = Stand::ready("dead_man");
    let pending = stand.begin();
    stand.wait_for_speed();
    stand.operator.as_mut().unwrap().let_go();
    let fault = FaultCode::DeadManReleased;
    stand.stops(&pending, &[fault]);
    // Acknowledged, but not held: no arming.
    stand.make_ready();
    let arming = arm_for(OperatingMode::SetUp, None);
    assert_eq!(stand.refused(&arming).0, fault);
    stand.operator.as_mut().unwrap().hold();
    recovers_from_a_brake(stand);
}

#[test]
fn a_killed_operator_is_missed_and_leaves_its_place_to_the_next() {
    let mut stand = Stand::ready_with("operator", |config| {
        config.thresholds.operator_timeout_ms = Some(500.0);
    });
    stand.operator = None;
    let mut other = Process::start(Role::Operator, "operator", &stand.config.domain);
    stand.rest(Duration::from_secs(1));
    let pending = stand.begin();
    stand.wait_for_speed();
    other.kill();
    stand.stops(&pending, &[FaultCode::OperatorLost]);
    stand.operator = Some(OperatorEnd::take(&stand.bus).unwrap());
    recovers_from_a_brake(stand);
}

/// The newest record says "offline" until the set-up is over; the stop must not be taken for
/// one of an arm that nobody holds.
#[test]
fn a_stop_during_the_bring_up_is_not_lost() {
    for wait_ms in [0, 5, 20, 60, 100, 140] {
        let mut stand = Stand::start(&format!("set_up_{wait_ms}"));
        let set_up = stand.call(&ControllerRequest::Bringup);
        std::thread::sleep(Duration::from_millis(wait_ms));
        assert_eq!(stand.ask(&ControllerRequest::Stop), ControllerEvent::Done);
        stand.answer(&set_up);
        assert_ne!(stand.mode(), ControllerMode::Idle, "after {wait_ms} ms");
        let arming = arm_for(OperatingMode::Throw, Some(clock::now()));
        assert_eq!(stand.refused(&arming).0, FaultCode::WrongMode);
    }
}

/// Whoever armed a throw could say so long before, and of another pose.
#[test]
fn an_arming_wants_a_fresh_confirmation_given_to_an_arm_at_rest() {
    let mut stand = Stand::ready("confirmed");
    let before = clock::now();
    stand.throws();
    for (confirmed, why) in [
        (None, "nobody confirmed"),
        (Some(before), "came to rest"),
        (Some(before.plus_s(-60.0)), "it must be within 10 s"),
        (Some(clock::now().plus_s(60.0)), "in the future"),
    ] {
        for mode in [OperatingMode::Wiggle, OperatingMode::Throw] {
            let (fault, message) = stand.refused(&arm_for(mode, confirmed));
            assert_eq!(fault, FaultCode::NotArmed);
            assert!(message.contains(why), "{message}");
        }
    }
    // What is armed has not begun yet, and moves elsewhere: the confirmation was for here.
    assert_eq!(stand.arm_for(OperatingMode::Throw), ControllerEvent::Done);
    let mut q = stand.commanded();
    q[6] += 0.1;
    let speed_fraction = 0.1;
    stand.moves(&ControllerRequest::MoveTo { q, speed_fraction });
    let swing = stand.swing_here();
    let (fault, message) = stand.refused(&swing);
    assert_eq!(fault, FaultCode::NotArmed);
    assert!(message.contains("came to rest"), "{message}");
    // The ten seconds count from the confirmation, not from the arming.
    let confirmed = clock::now();
    stand.rest(Duration::from_secs(8));
    let arming = arm_for(OperatingMode::Throw, Some(confirmed));
    assert_eq!(stand.ask(&arming), ControllerEvent::Done);
    stand.rest(Duration::from_millis(2500));
    let swing = stand.swing_here();
    let (fault, message) = stand.refused(&swing);
    assert_eq!(fault, FaultCode::ArmingExpired);
    assert!(message.contains("ran out"), "{message}");
    stand.finish();
}

/// A throw that was planned for an instant is another one later, nor is it moved to its start.
#[test]
fn what_is_to_begin_by_an_instant_does_not_begin_later() {
    let mut stand = Stand::ready("begins_by");
    let arming = |by_s: f64| {
        let now = clock::now();
        ControllerRequest::Arm {
            operating_mode: OperatingMode::Throw,
            confirmed_ns: Some(now.0),
            begins_by_ns: Some(now.plus_s(by_s).0),
        }
    };
    assert_eq!(stand.refused(&arming(-0.1)).0, FaultCode::ArmingExpired);
    assert_eq!(stand.ask(&arming(0.2)), ControllerEvent::Done);
    stand.rest(Duration::from_millis(300));
    let late = stand.swing_here();
    assert_eq!(stand.refused(&late).0, FaultCode::ArmingExpired);
    let mut aside = stand.commanded();
    aside[6] += 0.005;
    assert_eq!(stand.ask(&arming(5.0)), ControllerEvent::Done);
    let (fault, message) = stand.refused(&execute(&swing(aside)));
    assert_eq!(fault, FaultCode::StartPoseMismatch);
    assert!(message.contains("would make it late"), "{message}");
    assert_eq!(stand.ask(&arming(5.0)), ControllerEvent::Done);
    let punctual = stand.swing_here();
    stand.moves(&punctual);
    stand.finish();
}

#[test]
fn nothing_is_armed_unless_the_enabling_switch_is_held() {
    let number = 3;
    for (levels, held_high, is_held) in [
        (0x0008, true, true),
        (0x0008, false, false),
        (0xFFF7, false, true),
        (0xFFF7, true, false),
    ] {
        let arm = ArmConfig {
            digital_inputs: levels,
            ..ArmConfig::default()
        };
        let mut stand = Stand::with("enabling", arm, |config| {
            config.enabling_input = Some(EnablingInput { number, held_high });
        });
        stand.make_ready();
        for mode in [OperatingMode::SetUp, OperatingMode::Throw] {
            let arming = arm_for(mode, Some(clock::now()));
            if is_held {
                assert_eq!(stand.ask(&arming), ControllerEvent::Done);
            } else {
                let (fault, message) = stand.refused(&arming);
                assert_eq!(fault, FaultCode::NotArmed);
                assert!(message.contains("digital input 3"), "{message}");
            }
        }
        stand.finish();
    }
}

/// Until the loop has armed, nothing is known by which a motion could be judged: by then it is
/// refused, and what begins later is slow.
#[test]
fn a_motion_asked_for_while_an_arming_is_under_way_is_refused() {
    let mut stand = Stand::ready("arming");
    let mut q = stand.commanded();
    q[5] -= 0.5;
    let speed_fraction = 1.0;
    let asked = [
        arm_for(OperatingMode::SetUp, None),
        ControllerRequest::MoveTo { q, speed_fraction },
    ];
    let [armed, moved] = asked.map(|request| stand.call(&request));
    assert_eq!(stand.answer(&armed), ControllerEvent::Done);
    match stand.answer(&moved) {
        ControllerEvent::Refused { fault, .. } => assert_eq!(fault, FaultCode::WrongMode),
        // It was looked at after the loop had armed.
        ControllerEvent::Finished { .. } => {}
        other => panic!("{other:?}"),
    }
    let pole = stand.config.pole;
    let top_m_s = stand.finish().pole_top_m_s(&pole);
    assert!(top_m_s < 0.2525, "{top_m_s} m/s in a set-up move");
}
