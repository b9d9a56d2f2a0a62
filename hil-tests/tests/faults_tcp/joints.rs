//! The joints themselves: lag, a stuck joint, a jumping encoder.

use super::stand::Stand;
use shared_types::FaultCode;
use std::time::Duration;

/// Brakes, and asks the arm to stop; works again once the fault is over.
fn braked(name: &str, fault: &str, expected: &[FaultCode]) {
    let mut stand = Stand::ready(name);
    stand.stopped_by(fault, expected);
    stand.rest(Duration::from_secs(2));
    let flight = stand.recovers();
    let cause = flight.causes[0];
    assert_eq!((cause.path, cause.stop_arm), (2, 1), "{cause:?}");
}

#[test]
fn fault_19_an_arm_that_lags_is_braked_and_stopped() {
    let expected = [FaultCode::TrackingError, FaultCode::JointStuck];
    braked(
        "lag",
        "tracking_lag, lag_s = 0.3, duration_s = 1.0",
        &expected,
    );
}

#[test]
fn fault_20_a_stuck_joint_is_braked_and_stopped() {
    let expected = [FaultCode::JointStuck, FaultCode::TrackingError];
    braked(
        "stuck",
        "joint_stuck, joint = 6, duration_s = 2.5",
        &expected,
    );
}

#[test]
fn fault_21_an_encoder_that_jumps_5_degrees_is_braked_and_stopped() {
    let jump = "encoder_jump, joint = 4, by_rad = 0.0873, duration_s = 1.0";
    braked("encoder", jump, &[FaultCode::EncoderJump]);
}
