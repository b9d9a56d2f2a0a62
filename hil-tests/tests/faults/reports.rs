//! Faults of the joint reports: 14 to 18.

use super::judge::{assert_stopped_by, slowed};
use super::stage::{INTERFACES, Stage, config, mid_throw};
use hil_tests::scenario::entry;
use rt_controller::xarm::version::{ArmVersion, VersionError};
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
fn fault_14_a_report_stream_that_stops_slows_the_motion_within_100_ms() {
    let kind = "kind = \"report_stop\"\nduration_s = 3";
    let stale = slowed(FaultCode::ReportStale);
    assert_stopped_by(kind, stale, [0.1, 0.0], |stage, _| {
        assert_on_the_path(stage)
    });
}

#[test]
fn fault_15_reports_that_repeat_their_values_slow_the_motion() {
    let kind = "kind = \"report_freeze\"\nduration_s = 3";
    let frozen = slowed(FaultCode::ReportFrozen);
    assert_stopped_by(kind, frozen, [0.12, 0.0], |stage, _| {
        assert_on_the_path(stage)
    });
}

#[test]
fn fault_16_a_report_clock_that_jumps_wraps_or_drifts_is_followed() {
    for via in INTERFACES {
        for (kind, resyncs) in [
            ("kind = \"report_time_jump\"\nby_s = -0.4", 1),
            ("kind = \"report_time_jump\"\nby_s = -3", 1),
            ("kind = \"report_time_jump\"\nby_s = 0.4", 0),
            ("kind = \"report_time_jump\"\nby_s = 3", 0),
            ("kind = \"report_time_wrap\"", 1),
            ("kind = \"report_time_drift\"\nppm = 200\nduration_s = 9", 0),
            (
                "kind = \"report_time_drift\"\nppm = -200\nduration_s = 9",
                0,
            ),
        ] {
            let stage = Stage::thrown(via, &mid_throw(kind));
            stage.assert_undisturbed();
            assert!(stage.rig.counts().clock_resyncs >= resyncs, "{kind}");
        }
    }
}

#[test]
fn fault_16_a_report_clock_that_keeps_jumping_slows_the_motion() {
    for via in INTERFACES {
        let jump = "kind = \"report_time_jump\"\nby_s = -0.2";
        let script: String = (12..22)
            .map(|k| entry(&format!("on = \"speed:{}\"", f64::from(k) * 0.05), jump))
            .collect();
        let mut stage = Stage::thrown(via, &script);
        let cause = stage.assert_stop(slowed(FaultCode::ReportClock));
        assert!(cause.counts.clock_resyncs > 3);
        assert_on_the_path(&stage);
        stage.assert_works_again();
    }
}

/// What can be wrong with `frames` reports.
fn spoiled(frames: u32) -> [String; 5] {
    [
        "kind = \"report_torn\"\nkeep_bytes = 60",
        "kind = \"report_length\"\nclaim_bytes = 40000",
        "kind = \"report_nan\"\njoint = 2",
        "kind = \"report_infinity\"\njoint = 4",
        "kind = \"report_garbage\"",
    ]
    .map(|kind| format!("{kind}\nframes = {frames}"))
}

#[test]
fn fault_17_single_broken_reports_are_dropped_and_counted() {
    for via in INTERFACES {
        for kind in &spoiled(1) {
            let stage = Stage::thrown(via, &mid_throw(kind));
            stage.assert_undisturbed();
            assert!(stage.rig.counts().broken_reports >= 1, "{kind}");
        }
    }
}

#[test]
fn fault_17_five_broken_reports_in_a_row_slow_the_motion() {
    for via in INTERFACES {
        for kind in &spoiled(100)[2..] {
            let mut stage = Stage::thrown(via, &mid_throw(kind));
            let cause = stage.assert_stop(slowed(FaultCode::ReportBroken));
            assert_eq!(cause.limit.value, 5.0, "{kind}");
            assert_on_the_path(&stage);
            stage.assert_works_again();
        }
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
        stage.rig.start(super::judge::nod(stage.rig.commanded()));
        stage.finish();
        stage.assert_refused(FaultCode::ReportStale);
    }
    let check = |firmware: &str| {
        let text = format!("7,7,XS1305,AC1304,v{firmware}");
        ArmVersion::parse(&text).unwrap().check()
    };
    assert!(matches!(check("1.12.0"), Err(VersionError::TooOld(_))));
    assert!(matches!(
        check("3.0.0"),
        Err(VersionError::UnknownLayout(_))
    ));
    assert_eq!(check("2.8.2"), Ok(()));
}
