//! The joints themselves: lag, a stuck joint, a jumping encoder.

use super::stand::{Stand, at_speed};
use shared_types::FaultCode;
use std::time::Duration;

/// Brakes, and asks the arm to stop; works again once the fault is over.
fn braked(name: &str, kind: &str, expected: &[FaultCode]) {
    let mut stand = Stand::ready(name);
    stand.stopped_by(&at_speed(kind), expected);
    stand.rest(Duration::from_secs(2));
    let flight = stand.recovers();
    let cause = flight.causes[0];
    assert_eq!((cause.path, cause.stop_arm), (2, 1), "{cause:?}");
}

#[test]
fn fault_19_an_arm_that_lags_is_braked_and_stopped() {
    braked(
        "lag",
        "kind = \"tracking_lag\"\nlag_s = 0.3\nduration_s = 1.0",
        &[FaultCode::TrackingError, FaultCode::JointStuck],
    );
}

#[test]
fn fault_20_a_stuck_joint_is_braked_and_stopped() {
    braked(
        "stuck",
        "kind = \"joint_stuck\"\njoint = 6\nduration_s = 2.5",
        &[FaultCode::JointStuck, FaultCode::TrackingError],
    );
}

#[test]
fn fault_21_an_encoder_that_jumps_5_degrees_is_braked_and_stopped() {
    braked(
        "encoder",
        "kind = \"encoder_jump\"\njoint = 4\nby_rad = 0.0873\nduration_s = 1.0",
        &[FaultCode::EncoderJump],
    );
}
