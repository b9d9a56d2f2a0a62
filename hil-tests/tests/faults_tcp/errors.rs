//! What the arm raises or changes by itself: errors, emergency stops, mode and
//! state.

use super::stand::Stand;
use shared_types::FaultCode;
use shared_types::ipc::message::ControllerEvent;
use xarm_sim::{ArmEvent, clock};

/// Errors of the controller one after the other, each acknowledged.
fn raised(name: &str, codes: &[u8], fault: impl Fn(u8) -> String) {
    let mut stand = Stand::ready(name);
    for code in codes {
        // The stop that an error causes may be seen before the error itself.
        let expected = [
            FaultCode::ArmError,
            FaultCode::ArmNotReady,
            FaultCode::ArmModeChanged,
        ];
        let answer = stand.stopped_by(&fault(*code), &expected);
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
        format!("raise_error, code = {code}")
    });
}

#[test]
fn fault_10_collision_boundary_and_self_collision_stop_the_setpoints_at_once() {
    let raise = |code| format!("raise_error, code = {code}");
    raised("c31", &[31, 35, 22], raise);
}

#[test]
fn fault_11_an_emergency_stop_latches_until_it_is_released() {
    let press = |code| format!("emergency_stop, code = {code}, duration_s = 2.5");
    raised("e_stop", &[1, 2, 3], press);
}

#[test]
fn fault_12_no_setpoint_is_sent_in_a_mode_or_state_that_was_changed_under_us() {
    let mut stand = Stand::ready("mode");
    for fault in [
        "mode_changed, mode = 0",
        "state_changed, state = 4",
        "state_changed, state = 5",
        "state_changed, state = 3",
    ] {
        let expected = [FaultCode::ArmModeChanged, FaultCode::ArmNotReady];
        stand.stopped_by(fault, &expected);
        stand.make_ready();
    }
    stand.throws();
    let now = clock::now();
    let flight = stand.finish();
    let ignored = |e: &ArmEvent| matches!(e, ArmEvent::Ignored { .. });
    let before = flight.arm.iter().filter(|e| e.at < now);
    let ignored = before.filter(|e| ignored(&e.event)).count();
    // Those under way while the first refusal was on its way back.
    assert!(ignored <= 4 * 25, "{ignored}");
}
