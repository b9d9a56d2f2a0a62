//! Faults of the arm's controller: 9 to 12.

use super::judge::{assert_stopped_by, silenced};
use super::stage::{INTERFACES, Stage, config, mid_throw};
use arm_model::Limits;
use shared_types::ipc::{CauseRecord, ControllerMode};
use shared_types::{CommandInterface, FaultCode, MonotonicNs};

/// A throw that the arm ends by an error of its own: nothing is sent any more.
fn ended_by_the_arm(via: CommandInterface, kind: &str, code: u8) -> (Stage, CauseRecord) {
    let mut stage = Stage::thrown(via, &mid_throw(kind));
    let cause = stage.assert_stop(silenced(FaultCode::ArmError));
    assert_eq!(stage.arm_errors(), [code]);
    assert_stopped_sending(&stage, &cause);
    (stage, cause)
}

/// The reply to one command, or a report, tells; nothing is sent after it.
fn assert_stopped_sending(stage: &Stage, cause: &CauseRecord) {
    let noticed_s = MonotonicNs(cause.stamp_ns).since_s(stage.fault_began(1));
    assert!(noticed_s < 0.0081, "{noticed_s}");
    let ignored = stage.rig.with_arm(|arm| arm.model().counters().ignored);
    assert!(ignored <= 1, "{ignored} commands in a wrong state");
}

#[test]
fn fault_09_a_speed_error_of_the_arm_is_latched_with_speed_and_margin() {
    for via in INTERFACES {
        for code in [60, 24] {
            let raise = format!("kind = \"raise_error\"\ncode = {code}");
            let (mut stage, cause) = ended_by_the_arm(via, &raise, code);
            let part = cause.limit.value / cause.limit.limit;
            assert!((0.3..1.0).contains(&part), "{:?}", cause.limit);
            stage.assert_works_again();
        }
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
    for via in INTERFACES {
        for (kind, code) in [
            ("kind = \"collision\"", 31),
            ("kind = \"raise_error\"\ncode = 35", 35),
            ("kind = \"raise_error\"\ncode = 22", 22),
        ] {
            let (mut stage, _) = ended_by_the_arm(via, kind, code);
            stage.assert_works_again();
        }
    }
}

#[test]
fn fault_11_an_emergency_stop_lasts_until_it_is_released_and_acknowledged() {
    for via in INTERFACES {
        for code in 1..=3 {
            let press = format!("kind = \"emergency_stop\"\ncode = {code}\nduration_s = 8");
            let (mut stage, _) = ended_by_the_arm(via, &press, code);
            // Pressed still: an acknowledgement alone moves nothing.
            stage.rig.bring_up().unwrap();
            stage.rig.run_for(0.5);
            assert_eq!(stage.rig.mode(), ControllerMode::Faulted);
            assert_eq!(stage.rig.log.causes.len(), 2);
            stage.assert_nothing_moves_it();
            stage.rig.run_for(5.0);
            stage.assert_works_again();
        }
    }
}

#[test]
fn fault_12_no_command_is_sent_in_a_mode_or_state_that_somebody_changed() {
    for kind in [
        "kind = \"mode_changed\"\nmode = 0",
        "kind = \"state_changed\"\nstate = 3",
        "kind = \"state_changed\"\nstate = 4",
        "kind = \"state_changed\"\nstate = 5",
    ] {
        let not_ready = silenced(FaultCode::ArmNotReady);
        assert_stopped_by(kind, not_ready, [0.0081, 0.0], assert_stopped_sending);
    }
}
