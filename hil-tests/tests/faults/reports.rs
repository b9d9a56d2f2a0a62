//! Faults of the joint reports: 14 to 18.

use super::judge::{assert_borne, assert_stopped_by, slowed};
use super::stage::{INTERFACES, Stage, config, mid_throw};
use hil_tests::scenario::entry;
use shared_types::FaultCode;
use xarm_sim::Firmware;

/// A slow-down leaves the planned path nowhere.
fn assert_on_the_path(stage: &Stage) {
    for record in stage.on_path() {
        let off = record.q_c - stage.throw.state_at(record.trajectory_s).q;
        assert!(off.max_abs() < 1e-9, "{off:?} off the path");
    }
}

#[test]
fn fault_14_and_15_reports_that_stop_or_repeat_their_values_slow_the_motion() {
    for (fault, code, noticed_s) in [
        ("report_stop, duration_s = 3", FaultCode::ReportStale, 0.1),
        (
            "report_freeze, duration_s = 3",
            FaultCode::ReportFrozen,
            0.12,
        ),
    ] {
        let script = mid_throw(fault);
        assert_stopped_by(&script, slowed(code), [noticed_s, 0.0], |stage, _| {
            assert_on_the_path(stage);
        });
    }
}

#[test]
fn fault_16_a_report_clock_that_jumps_wraps_or_drifts_is_followed() {
    for (fault, resyncs) in [
        ("report_time_jump, by_s = -0.4", 1),
        ("report_time_jump, by_s = -3", 1),
        ("report_time_jump, by_s = 0.4", 0),
        ("report_time_jump, by_s = 3", 0),
        ("report_time_wrap", 1),
        ("report_time_drift, ppm = 200, duration_s = 9", 0),
        ("report_time_drift, ppm = -200, duration_s = 9", 0),
    ] {
        assert_borne(&mid_throw(fault), |counts| counts.clock_resyncs >= resyncs);
    }
}

#[test]
fn fault_16_a_report_clock_that_keeps_jumping_slows_the_motion() {
    let at_speed = |k: i32| format!("on = 'speed:{}'", f64::from(k) * 0.05);
    let script: String = (12..22)
        .map(|k| entry(&at_speed(k), "report_time_jump, by_s = -0.2"))
        .collect();
    let jumps = slowed(FaultCode::ReportClock);
    assert_stopped_by(&script, jumps, [f64::INFINITY, 0.0], |stage, cause| {
        assert!(cause.counts.clock_resyncs > 3);
        assert_on_the_path(stage);
    });
}

/// What can be wrong with `frames` reports, in the middle of the throw.
fn spoiled(frames: u32) -> [String; 5] {
    [
        "report_truncated, keep_bytes = 60",
        "report_length, claim_bytes = 40000",
        "report_nan, joint = 2",
        "report_infinity, joint = 4",
        "report_garbage",
    ]
    .map(|fault| mid_throw(&format!("{fault}, frames = {frames}")))
}

#[test]
fn fault_17_single_broken_reports_are_dropped_and_counted() {
    for script in &spoiled(1) {
        assert_borne(script, |counts| counts.broken_reports >= 1);
    }
}

#[test]
fn fault_17_five_broken_reports_in_a_row_slow_the_motion() {
    let broken = slowed(FaultCode::ReportBroken);
    for script in &spoiled(100)[2..] {
        assert_stopped_by(script, broken, [f64::INFINITY, 0.0], |stage, cause| {
            assert_eq!(cause.limit.value, 5.0, "{script}");
            assert_on_the_path(stage);
        });
    }
}

/// An arm without the report cannot be watched, so nothing moves; the bring-up
/// of a real process refuses it by its version before that.
#[test]
fn fault_18_firmware_without_a_known_report_is_refused() {
    for via in INTERFACES {
        let mut config = config(via, "");
        config.arm.firmware = Firmware(1, 12, 0);
        let mut stage = Stage::of(config);
        stage.arm();
        stage.start_nod();
        stage.finish();
        stage.assert_refused(FaultCode::ReportStale);
    }
}
