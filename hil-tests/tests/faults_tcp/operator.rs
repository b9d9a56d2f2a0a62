//! The operator: silent, killed, or letting go of the dead-man switch.

use super::child::{Process, Role};
use super::stand::Stand;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use shared_types::{FaultCode, OperatingMode};
use std::time::Duration;
use xarm_sim::ArmConfig;

/// How a stop was met: braked in joint space, and the arm left ready.
const BRAKED: (u8, u8) = (2, 0);

#[test]
fn fault_36_a_dead_man_switch_let_go_brakes_and_holds_until_it_is_held_again() {
    let mut stand = Stand::ready("dead_man");
    let pending = stand.begin();
    stand.wait_for_speed();
    stand.operator().let_go();
    let answer = stand.answer(&pending);
    let fault = FaultCode::DeadManReleased;
    assert!(
        matches!(answer, ControllerEvent::Stopped { fault: f, .. } if f == fault),
        "{answer:?}"
    );
    stand.expect(&[fault]);
    stand.is_latched();
    // Acknowledged, but not held: no arming.
    stand.make_ready();
    let arming = ControllerRequest::Arm {
        operating_mode: OperatingMode::SetUp,
        area_clear: true,
    };
    assert_eq!(stand.refused(&arming).0, fault);
    stand.operator().hold();
    let flight = stand.recovers();
    let cause = flight.causes[0];
    assert_eq!((cause.path, cause.stop_arm), BRAKED, "{cause:?}");
}

#[test]
fn a_killed_operator_is_missed_and_leaves_its_place_to_the_next() {
    let mut stand = Stand::with("operator", ArmConfig::default(), |config| {
        config.thresholds.operator_timeout_ms = Some(500.0);
    });
    stand.make_ready();
    stand.leave();
    let mut other = Process::start(Role::Operator, "operator", &stand.config.domain);
    stand.rest(Duration::from_secs(1));
    let pending = stand.begin();
    stand.wait_for_speed();
    other.kill();
    let answer = stand.answer(&pending);
    let fault = FaultCode::OperatorLost;
    assert!(
        matches!(answer, ControllerEvent::Stopped { fault: f, .. } if f == fault),
        "{answer:?}"
    );
    stand.expect(&[fault]);
    stand.is_latched();
    stand.take_the_operators_place();
    let flight = stand.recovers();
    let cause = flight.causes[0];
    assert_eq!((cause.path, cause.stop_arm), BRAKED, "{cause:?}");
}
