//! Faults of the command link: 1, 4, 5, 6, 7, 8, 13.

use super::judge::{assert_borne, assert_stopped_by, silenced, stopped};
use super::stage::{INTERFACES, Stage, mid_throw};
use arm_model::{JointVector, Limits, kinematics};
use hil_tests::scenario::entry;
use rt_controller::xarm::{ArmState, Command, Register, StateRequest};
use shared_types::{CommandInterface, FaultCode, MonotonicNs};
use xarm_sim::ArmEvent;

/// From an unanswered setpoint to the cause (s): two cycles, and one until a
/// setpoint meets the fault.
const NOTICED_WITHIN_S: f64 = 0.0121;
/// From a reply that shows a fault to the cause (s).
const SHOWN_WITHIN_S: f64 = 0.0081;

fn tool(q: &JointVector) -> nalgebra::Vector3<f64> {
    kinematics::flange_pose(q).0
}

/// The queue in the network holds at most what was sent before the stall was
/// noticed. When it lets go, the stop comes with it: no burst is followed.
#[test]
fn fault_01_a_stall_of_190_ms_ends_in_a_stop_and_not_in_a_burst() {
    let script = mid_throw("stall, duration_s = 0.19");
    let stalled = stopped(FaultCode::ReplyStalled);
    assert_stopped_by(&script, stalled, [NOTICED_WITHIN_S, 0.0], |stage, _| {
        let began = stage.fault_began(1);
        let released = began.plus_s(0.19);
        let arrivals = stage.rig.log.arrivals();
        let held: Vec<_> = arrivals.filter(|(at, _)| *at >= began).collect();
        assert!(held.len() <= 3, "{}", held.len());
        assert!(held.iter().all(|(at, _)| at.since_s(released).abs() < 2e-3));
        let events = &stage.rig.log.arm_events;
        let stop = Register::SetState.code();
        let last = events
            .iter()
            .filter(|e| !matches!(e.event, ArmEvent::State { .. }))
            .rfind(|e| e.at < released.plus_s(0.01) && e.client.is_some())
            .unwrap();
        assert_eq!(
            last.event,
            ArmEvent::Request { register: stop },
            "the stop comes last"
        );
        // The arm stood still at the end of the stall; what it does then is no
        // more than the step of a cycle.
        let pose_at = |at: MonotonicNs| {
            let truth = &stage.rig.log.truth;
            truth[truth.partition_point(|s| s.at < at)].state.q
        };
        let frozen = pose_at(released.plus_s(-0.002));
        let last = stage.rig.log.truth.last().unwrap().state.q;
        assert!((last - frozen).max_abs() < 0.004 * Limits::default().velocity_max_rad_s[0]);
        assert!((tool(&last) - tool(&frozen)).norm() < 0.010);
        if let (CommandInterface::ServoPosition, Some((_, first))) = (stage.via, held.first()) {
            assert!((tool(first) - tool(&frozen)).norm() < 0.010);
        }
    });
}

#[test]
fn fault_01_a_stall_of_up_to_6_ms_is_borne() {
    for via in INTERFACES {
        for duration_s in [0.005, 0.006] {
            let stall = format!("stall, duration_s = {duration_s}");
            let stage = Stage::thrown(via, &mid_throw(&stall));
            stage.assert_finished(duration_s + 0.001);
            stage.assert_same_path();
        }
    }
}

/// The guardian asks the arm to stop on a connection of its own.
fn stop_as_the_guardian_does(stage: &mut Stage) {
    let stop = Command::SetState(StateRequest::Stop);
    stage.rig.command_from_elsewhere(&stop).unwrap();
    stage.rig.run_for(0.1);
    assert_eq!(stage.arm_state(), ArmState::Stopped);
}

#[test]
fn fault_04_a_reset_connection_is_latched_and_a_new_one_resumes_nothing() {
    let (script, lost) = (mid_throw("connection_reset"), silenced(FaultCode::LinkLost));
    assert_stopped_by(&script, lost, [SHOWN_WITHIN_S, 0.0], |stage, _| {
        assert!(!stage.rig.is_connected());
        stop_as_the_guardian_does(stage);
    });
}

#[test]
fn fault_05_a_half_open_link_is_noticed_in_two_cycles() {
    let (script, stalled) = (mid_throw("half_open"), stopped(FaultCode::ReplyStalled));
    assert_stopped_by(&script, stalled, [NOTICED_WITHIN_S, 0.0], |stage, _| {
        // The controller's own stop cannot get through; the guardian's does.
        assert_eq!(stage.arm_state(), ArmState::Ready);
        stop_as_the_guardian_does(stage);
    });
}

#[test]
fn fault_06_a_cable_that_comes_back_after_500_ms_changes_nothing() {
    let script = mid_throw("cable_pull, duration_s = 0.5");
    let stalled = stopped(FaultCode::ReplyStalled);
    assert_stopped_by(&script, stalled, [NOTICED_WITHIN_S, 0.0], |_, _| ());
}

#[test]
fn fault_07_replies_out_of_order_and_doubled_are_counted_and_nothing_else() {
    let always = |fault| entry("at_s = 0.1", fault);
    let reordered = always("replies_reordered, duration_s = 10");
    assert_borne(&reordered, |counts| counts.out_of_order > 100);
    let duplicated = always("replies_duplicated, duration_s = 10");
    assert_borne(&duplicated, |counts| counts.duplicates > 100);
}

#[test]
fn fault_08_a_reply_with_a_warning_is_counted_one_with_an_error_ends_the_motion() {
    let bit = |kind: &str| mid_throw(&format!("{kind}, duration_s = 0.1"));
    assert_borne(&bit("warning_bit"), |counts| counts.warnings >= 20);
    for (kind, fault) in [
        ("error_bit", FaultCode::ArmError),
        ("not_ready_bit", FaultCode::ArmNotReady),
    ] {
        assert_stopped_by(
            &bit(kind),
            silenced(fault),
            [SHOWN_WITHIN_S, 0.0],
            |_, _| (),
        );
    }
}

/// Somebody else streams the arm's own pose, a milliradian off: where both
/// streams are slow, nothing but the arm's target shows it.
#[test]
fn fault_13_a_second_commander_is_noticed_by_the_arms_own_target() {
    let script = entry(
        "at_s = 1.5",
        "second_commander, request = 'setpoints', rate_hz = 60, duration_s = 1",
    );
    let mut stage = Stage::ready(CommandInterface::ServoPosition, &script);
    stage.rig.run_for(2.0);
    let causes = stage.rig.log.causes.clone();
    assert_eq!(causes.len(), 1, "{causes:?}");
    assert_eq!(causes[0].fault(), FaultCode::SecondCommander);
    let noticed_s = MonotonicNs(causes[0].stamp_ns).since_s(stage.fault_began(1));
    assert!(noticed_s < 0.5, "{noticed_s}");
    stage.assert_nothing_moves_it();
    assert_eq!(stage.rig.log.causes, causes);
    stage.assert_works_again();
}

#[test]
fn fault_13_a_second_commander_in_the_middle_of_a_throw_ends_it() {
    let commander = |request: &str| {
        let fault =
            format!("second_commander, request = '{request}', rate_hz = 50, duration_s = 0.2");
        mid_throw(&fault)
    };
    let not_ready = silenced(FaultCode::ArmNotReady);
    for request in ["stop", "mode"] {
        assert_stopped_by(&commander(request), not_ready, [0.1, 0.0], |_, _| ());
    }
    // Positions are nothing to an arm that follows velocities.
    let script = commander("setpoints");
    Stage::thrown(CommandInterface::JointVelocity, &script).assert_undisturbed();
    // In servo mode setpoints beside a fast path are too fast for the arm.
    let mut stage = Stage::thrown(CommandInterface::ServoPosition, &script);
    let cause = stage.assert_stop(silenced(FaultCode::ArmError));
    assert_eq!(stage.arm_errors(), [24], "{cause:?}");
    stage.assert_works_again();
}
