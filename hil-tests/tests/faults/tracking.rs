//! The arm is not where it was told to be: 19 to 21.

use super::judge::{assert_stopped_by, braked_and_stopped};
use super::stage::{INTERFACES, Stage, mid_throw};
use arm_model::JointTrajectory;
use hil_tests::scenario::entry;
use rt_controller::control::Motion;
use shared_types::FaultCode;

#[test]
fn fault_19_an_arm_that_lags_by_100_ms_is_braked() {
    for via in INTERFACES {
        let script = entry("at_s = 0.1", "tracking_lag, lag_s = 0.1");
        let mut stage = Stage::thrown(via, &script);
        let cause = stage.assert_stop(braked_and_stopped(FaultCode::TrackingError));
        assert!([2, 4, 6].contains(&cause.limit.joint), "{:?}", cause.limit);
        assert!(cause.limit.value < 0.1, "noticed late: {:?}", cause.limit);
    }
}

/// A joint that is held or whose encoder is off for 8 s: the cause names it.
fn assert_joint_is_named(fault: &str, joint: u32, code: FaultCode, noticed_s: f64) {
    let script = mid_throw(&format!("{fault}, joint = {joint}, duration_s = 8"));
    // Free again it goes where it was told to be last.
    assert_stopped_by(
        &script,
        braked_and_stopped(code),
        [noticed_s, 8.0],
        |_, cause| {
            assert_eq!(cause.limit.joint, joint);
        },
    );
}

#[test]
fn fault_20_a_joint_that_is_stuck_is_named_and_the_others_are_braked() {
    for joint in [2, 4, 6] {
        assert_joint_is_named("joint_stuck", joint, FaultCode::JointStuck, 0.2);
    }
}

/// Slow enough that what it was told when it got stuck is long forgotten.
#[test]
fn fault_20_a_joint_that_sticks_in_a_slow_motion_is_named_too() {
    for via in INTERFACES {
        let script = entry("at_s = 0.1", "joint_stuck, joint = 7, duration_s = 9");
        let mut stage = Stage::ready(via, &script);
        stage.arm();
        let from = stage.rig.commanded();
        let mut to = from;
        (to[0], to[6]) = (to[0] + 0.1, to[6] + 0.1);
        let slow = JointTrajectory::new(&[0.0, 2.0], &[from, to]).unwrap();
        stage.rig.start(Motion::Spline(slow));
        stage.rig.run_for(3.0);
        let cause = stage.assert_stop(braked_and_stopped(FaultCode::JointStuck));
        assert_eq!(cause.limit.joint, 7);
    }
}

#[test]
fn fault_21_an_encoder_that_jumps_by_five_degrees_is_noticed_with_the_next_report() {
    for sign in [1.0, -1.0] {
        let jump = format!("encoder_jump, by_rad = {}", sign * 5_f64.to_radians());
        assert_joint_is_named(&jump, 4, FaultCode::EncoderJump, 0.013);
    }
}

/// At rest nothing is watched that only motion can show, but no motion begins
/// from where the arm is not.
#[test]
fn fault_21_an_encoder_that_jumped_at_rest_refuses_the_next_motion() {
    for via in INTERFACES {
        let script = entry("at_s = 1.0", "encoder_jump, joint = 1, by_rad = 0.0873");
        let mut stage = Stage::ready(via, &script);
        stage.rig.run_for(0.5);
        stage.arm();
        stage.start_nod();
        stage.rig.run_cycles(3);
        stage.assert_refused(FaultCode::StartPoseMismatch);
    }
}
