//! What goes wrong with the reports, and what firmware leaves out of them.

use super::scenario::{CYCLE_S, START, Scenario};
use hil_tests::scenario::entry;
use rt_controller::xarm::report::{RealtimeReport, RichReport};
use rt_controller::xarm::{Command, Mode, Status};
use xarm_sim::{ArmConfig, Firmware, ReportKind, Service};

/// Real-time reports of a run with a fault at 0.5 s, as bytes, by arrival (ms).
fn reports(kind: &str) -> Vec<(u64, Vec<u8>)> {
    let mut b = Scenario::new(&entry("at_s = 0.5", kind));
    let client = b.reports(ReportKind::Realtime);
    b.bring_up(Mode::Servo);
    let mut seen = Vec::new();
    for _ in 0..250 {
        b.stream(0.3, CYCLE_S);
        while let Some(frame) = b.arm.take_frame(client, b.now) {
            seen.push(((b.now.0 - START.0) / 1_000_000, frame));
        }
    }
    seen
}

#[test]
fn report_streams_stop_freeze_and_show_wrong_times() {
    let healthy = reports("collision");
    assert!(healthy.len() >= 249 && healthy.iter().all(|(_, f)| f.len() == 784));

    let stopped = reports("report_stop, duration_s = 0.3");
    assert!((173..=177).contains(&stopped.len()), "{}", stopped.len());

    let parse = |frames: &[(u64, Vec<u8>)]| -> Vec<RealtimeReport> {
        let parse = |(_, f): &(u64, Vec<u8>)| RealtimeReport::parse(f).unwrap();
        frames.iter().map(parse).collect()
    };
    let frozen = parse(&reports("report_freeze, duration_s = 0.3"));
    let same = frozen
        .windows(2)
        .filter(|w| w[0].actual == w[1].actual && w[1].time_us > w[0].time_us)
        .count();
    assert!((74..=85).contains(&same), "{same}");

    let steps = |kind: &str| -> Vec<i64> {
        parse(&reports(kind))
            .windows(2)
            .map(|w| w[1].time_us.cast_signed() - w[0].time_us.cast_signed())
            .collect()
    };
    let jump = steps("report_time_jump, by_s = -0.5");
    assert_eq!(jump.iter().filter(|s| **s == -496_000).count(), 1);
    let wrap = steps("report_time_wrap");
    assert_eq!(wrap.iter().filter(|s| **s < -100_000_000).count(), 1);
    let drift: i64 = steps("report_time_drift, ppm = 10000").iter().sum();
    assert!((drift - 1_005_000).abs() < 3_000, "{drift}");
}

#[test]
fn spoiled_reports_are_torn_mislabelled_or_no_numbers() {
    let count =
        |kind: &str, is: fn(&[u8]) -> bool| reports(kind).iter().filter(|(_, f)| is(f)).count();
    let truncated = "report_truncated, frames = 3, keep_bytes = 60";
    assert_eq!(count(truncated, |f| f.len() == 60), 3);
    let length = "report_length, frames = 2, claim_bytes = 12";
    assert_eq!(count(length, |f| f[..4] == [0, 0, 0, 12]), 2);
    fn second(f: &[u8]) -> f64 {
        RealtimeReport::parse(f).unwrap().actual.q[1]
    }
    let nan = "report_nan, frames = 4, joint = 2";
    assert_eq!(count(nan, |f| second(f).is_nan()), 4);
    let infinity = "report_infinity, frames = 4, joint = 2";
    assert_eq!(count(infinity, |f| second(f).is_infinite()), 4);
    // A proper stamp is far below a day.
    let day_us = |f: &[u8]| RealtimeReport::parse(f).unwrap().time_us > 86_400_000_000;
    let garbage = "report_garbage, frames = 5";
    assert_eq!(count(garbage, day_us), 5);
}

#[test]
fn firmware_decides_layouts_and_what_is_known() {
    let config = |firmware| ArmConfig {
        firmware,
        ..ArmConfig::default()
    };
    let sizes = |firmware| {
        let mut b = Scenario::with("", config(firmware));
        ReportKind::ALL.map(|kind| {
            let client = b.arm.connect(Service::Reports(kind), b.now).ok()?;
            b.arm.take_frame(client, b.now).map(|frame| frame.len())
        })
    };
    let of = |realtime, rich| [realtime, Some(145), Some(rich), Some(135)];
    assert_eq!(sizes(Firmware(2, 7, 1)), of(Some(784), 574));
    assert_eq!(sizes(Firmware(2, 8, 2)), of(Some(804), 587));
    assert_eq!(sizes(Firmware(2, 1, 0)), of(Some(784), 495));
    assert_eq!(sizes(Firmware(1, 12, 10)), of(None, 417));

    let factor = |firmware| {
        let mut b = Scenario::with("", config(firmware));
        b.send(&Command::GetSpeedLimitFactor);
        Status(b.replies[0].status).is_invalid()
    };
    assert!(factor(Firmware(2, 2, 0)) && !factor(Firmware(2, 3, 0)));

    // A change concerns new connections; the old ones keep their size.
    let mut b = Scenario::new(&entry("at_s = 0.1", "firmware_changed, version = '2.8.2'"));
    let old = b.reports(ReportKind::Rich);
    b.wait(0.3);
    let new = b.reports(ReportKind::Rich);
    let len = |b: &mut Scenario, client| {
        let mut last = 0;
        while let Some(frame) = b.arm.take_frame(client, b.now) {
            last = frame.len();
            let report = RichReport::parse(&frame).unwrap();
            assert!(report.firmware.starts_with(b"v2."));
        }
        last
    };
    assert_eq!((len(&mut b, old), len(&mut b, new)), (574, 587));
}
