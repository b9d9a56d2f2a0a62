//! Faults of the arm's controller: 9 to 12.

use super::judge::{assert_stopped_by, silenced};
use super::stage::{Stage, config, mid_throw};
use arm_model::Limits;
use shared_types::ipc::{CauseRecord, ControllerMode};
use shared_types::{CommandInterface, FaultCode};

/// From a reply to one command, or a report, to the cause (s).
const NOTICED_WITHIN_S: f64 = 0.0081;

/// A throw that the arm ends by an error of its own: nothing is sent any more.
fn assert_ended_by_the_arm(fault: &str, code: u8, also: impl Fn(&mut Stage, &CauseRecord)) {
    let error = silenced(FaultCode::ArmError);
    assert_stopped_by(
        &mid_throw(fault),
        error,
        [NOTICED_WITHIN_S, 0.0],
        |stage, cause| {
            assert_eq!(stage.arm_errors(), [code]);
            assert_stopped_sending(stage);
            also(stage, cause);
        },
    );
}

fn assert_stopped_sending(stage: &Stage) {
    let ignored = stage.rig.with_arm(|arm| arm.model().counters().ignored);
    assert!(ignored <= 1, "{ignored} commands in a wrong state");
}

#[test]
fn fault_09_a_speed_error_of_the_arm_is_latched_with_speed_and_margin() {
    for code in [60, 24] {
        assert_ended_by_the_arm(&format!("raise_error, code = {code}"), code, |_, cause| {
            let part = cause.limit.value / cause.limit.limit;
            assert!((0.3..1.0).contains(&part), "{:?}", cause.limit);
        });
    }
}

/// An arm set to a smaller factor than the limits say stops with a real C60; the
/// cause shows a speed above what the arm took.
#[test]
fn fault_09_an_arm_slower_than_its_limits_stops_with_c60() {
    let mut config = config(CommandInterface::ServoPosition, "");
    config.arm.speed_limit_factor = 0.8;
    let mut stage = Stage::of(config);
    stage.begin();
    stage.finish();
    let cause = stage.assert_stop(silenced(FaultCode::ArmError));
    assert_eq!(stage.arm_errors(), [60]);
    let limits = Limits::default();
    assert_eq!(
        (cause.limit.joint, cause.limit.limit),
        (0, limits.tcp_speed_max_m_s)
    );
    assert!((0.8..1.2).contains(&cause.limit.value), "{:?}", cause.limit);
    stage.assert_works_again();
}

#[test]
fn fault_10_a_collision_or_a_boundary_is_latched() {
    for (fault, code) in [
        ("collision", 31),
        ("raise_error, code = 35", 35),
        ("raise_error, code = 22", 22),
    ] {
        assert_ended_by_the_arm(fault, code, |_, _| ());
    }
}

#[test]
fn fault_11_an_emergency_stop_lasts_until_it_is_released_and_acknowledged() {
    for code in 1..=3 {
        let pressed = format!("emergency_stop, code = {code}, duration_s = 8");
        assert_ended_by_the_arm(&pressed, code, |stage, _| {
            // Pressed still: an acknowledgement alone moves nothing.
            stage.rig.bring_up().unwrap();
            stage.rig.run_for(0.5);
            assert_eq!(stage.rig.mode(), ControllerMode::Faulted);
            assert_eq!(stage.rig.log.causes.len(), 2);
            stage.assert_nothing_moves_it();
            stage.rig.run_for(5.0);
        });
    }
}

#[test]
fn fault_12_no_command_is_sent_in_a_mode_or_state_that_somebody_changed() {
    let not_ready = silenced(FaultCode::ArmNotReady);
    for fault in [
        "mode_changed, mode = 0",
        "state_changed, state = 3",
        "state_changed, state = 4",
        "state_changed, state = 5",
    ] {
        let script = mid_throw(fault);
        assert_stopped_by(&script, not_ready, [NOTICED_WITHIN_S, 0.0], |stage, _| {
            assert_stopped_sending(stage);
        });
    }
}
