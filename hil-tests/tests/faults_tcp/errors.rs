//! What the arm raises or changes by itself: errors, emergency stops, mode and
//! state.

use super::stand::{Stand, at_speed};
use shared_types::FaultCode;
use shared_types::ipc::message::ControllerEvent;
use xarm_sim::{ArmEvent, clock};

/// Errors of the controller one after the other, each acknowledged.
fn raised(name: &str, codes: &[u8], kind: impl Fn(u8) -> String) {
    let mut stand = Stand::ready(name);
    for code in codes {
        // The stop that an error causes may be seen before the error itself.
        let expected = [
            FaultCode::ArmError,
            FaultCode::ArmNotReady,
            FaultCode::ArmModeChanged,
        ];
        let answer = stand.stopped_by(&at_speed(&kind(*code)), &expected);
        let ControllerEvent::Stopped {
            arm_error, message, ..
        } = answer
        else {
            unreachable!();
        };
        assert_eq!(arm_error, *code, "{message}");
        assert!(message.contains(&format!("C{code}")), "{message}");
        stand.make_ready();
    }
    stand.throws();
    stand.finish();
}

#[test]
fn fault_09_speed_limits_the_arm_finds_stop_the_setpoints_at_once() {
    raised("c60", &[60, 24], |code| {
        format!("kind = \"raise_error\"\ncode = {code}")
    });
}

#[test]
fn fault_10_collision_boundary_and_self_collision_stop_the_setpoints_at_once() {
    raised("c31", &[31, 35, 22], |code| {
        format!("kind = \"raise_error\"\ncode = {code}")
    });
}

#[test]
fn fault_11_an_emergency_stop_latches_until_it_is_released() {
    raised("e_stop", &[1, 2, 3], |code| {
        format!("kind = \"emergency_stop\"\ncode = {code}\nduration_s = 2.5")
    });
}

#[test]
fn fault_12_no_setpoint_is_sent_in_a_mode_or_state_that_was_changed_under_us() {
    let mut stand = Stand::ready("mode");
    let expected = [FaultCode::ArmModeChanged, FaultCode::ArmNotReady];
    for kind in [
        "kind = \"mode_changed\"\nmode = 0",
        "kind = \"state_changed\"\nstate = 4",
        "kind = \"state_changed\"\nstate = 5",
        "kind = \"state_changed\"\nstate = 3",
    ] {
        stand.stopped_by(&at_speed(kind), &expected);
        stand.make_ready();
    }
    stand.throws();
    let now = clock::now();
    let flight = stand.finish();
    let ignored: Vec<_> = flight
        .arm
        .iter()
        .filter(|e| matches!(e.event, ArmEvent::Ignored { .. }) && e.at < now)
        .collect();
    // Those under way while the first refusal was on its way back.
    assert!(ignored.len() <= 4 * 25, "{}", ignored.len());
}
