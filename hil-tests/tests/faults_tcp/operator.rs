//! The operator: silent, killed, or letting go of the dead-man switch.

use super::child::{Process, Role};
use super::stand::{Stand, arm_for};
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::ipc::{ControllerMode, OperatorEnd};
use shared_types::{FaultCode, OperatingMode};
use std::time::Duration;

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
    let arming = arm_for(OperatingMode::SetUp, true);
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
        let arming = arm_for(OperatingMode::Throw, true);
        assert_eq!(stand.refused(&arming).0, FaultCode::WrongMode);
    }
}
