//! The arm is not where it was told to be: 19 to 21.

use super::judge::{assert_stopped_by, braked_and_stopped, nod};
use super::stage::{INTERFACES, Stage};
use hil_tests::scenario::entry;
use shared_types::FaultCode;

#[test]
fn fault_19_an_arm_that_lags_by_100_ms_is_braked() {
    for via in INTERFACES {
        let script = entry("at_s = 0.1", "kind = \"tracking_lag\"\nlag_s = 0.1");
        let mut stage = Stage::thrown(via, &script);
        let cause = stage.assert_stop(braked_and_stopped(FaultCode::TrackingError));
        assert!([2, 4, 6].contains(&cause.limit.joint), "{:?}", cause.limit);
        assert!(cause.limit.value < 0.1, "noticed late: {:?}", cause.limit);
    }
}

#[test]
fn fault_20_a_joint_that_is_stuck_is_named_and_the_others_are_braked() {
    for joint in [2, 4, 6] {
        let kind = format!("kind = \"joint_stuck\"\njoint = {joint}\nduration_s = 8");
        let stuck = braked_and_stopped(FaultCode::JointStuck);
        // Free again it goes where it was told to be last.
        assert_stopped_by(&kind, stuck, [0.2, 8.0], |_, cause| {
            assert_eq!(cause.limit.joint, joint);
        });
    }
}

/// Slow enough that what it was told when it got stuck is long forgotten.
#[test]
fn fault_20_a_joint_that_sticks_in_a_slow_motion_is_named_too() {
    for via in INTERFACES {
        let script = entry(
            "at_s = 0.1",
            "kind = \"joint_stuck\"\njoint = 7\nduration_s = 9",
        );
        let mut stage = Stage::ready(via, &script);
        stage.arm();
        let from = stage.rig.commanded();
        let mut to = from;
        (to[0], to[6]) = (to[0] + 0.1, to[6] + 0.1);
        let slow = arm_model::JointTrajectory::new(&[0.0, 2.0], &[from, to]).unwrap();
        stage
            .rig
            .start(rt_controller::control::Motion::Spline(slow));
        stage.rig.run_for(3.0);
        let cause = stage.assert_stop(braked_and_stopped(FaultCode::JointStuck));
        assert_eq!(cause.limit.joint, 7);
    }
}

#[test]
fn fault_21_an_encoder_that_jumps_by_five_degrees_is_noticed_with_the_next_report() {
    for sign in [1.0, -1.0] {
        let by = sign * 5_f64.to_radians();
        let kind = format!("kind = \"encoder_jump\"\njoint = 4\nby_rad = {by}\nduration_s = 8");
        let jumped = braked_and_stopped(FaultCode::EncoderJump);
        assert_stopped_by(&kind, jumped, [0.013, 8.0], |_, cause| {
            assert_eq!(cause.limit.joint, 4);
        });
    }
}

/// At rest nothing is watched that only motion can show, but no motion begins
/// from where the arm is not.
#[test]
fn fault_21_an_encoder_that_jumped_at_rest_refuses_the_next_motion() {
    for via in INTERFACES {
        let script = entry(
            "at_s = 1.0",
            "kind = \"encoder_jump\"\njoint = 1\nby_rad = 0.0873",
        );
        let mut stage = Stage::ready(via, &script);
        stage.rig.run_for(0.5);
        stage.arm();
        stage.rig.start(nod(stage.rig.commanded()));
        stage.rig.run_cycles(3);
        stage.assert_refused(FaultCode::StartPoseMismatch);
    }
}
