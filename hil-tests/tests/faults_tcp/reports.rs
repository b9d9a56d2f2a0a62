//! The joint reports: silent, frozen, out of time, truncated, no numbers; and arms
//! whose reports have another layout.

use super::stand::Stand;
use rt_controller::ControllerConfig;
use rt_controller::config::OnDifference;
use shared_types::FaultCode;
use shared_types::ipc::message::{ControllerEvent, ControllerRequest};
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use xarm_sim::{ArmConfig, Firmware};

/// The profile's own patience with reports: 100 ms.
fn impatient(config: &mut ControllerConfig) {
    config.thresholds.report_stale_ms = None;
}

#[test]
fn fault_14_reports_that_stop_slow_the_motion_along_its_path() {
    let mut stand = Stand::ready_with("report_stop", impatient);
    stand.stopped_by(
        "report_stop, port = 'all', duration_s = 1.0",
        &[FaultCode::ReportStale],
    );
    let flight = stand.recovers();
    assert_eq!(flight.causes[0].path, 1, "{:?}", flight.causes[0]);
}

#[test]
fn fault_15_frozen_reports_slow_the_motion_along_its_path() {
    let mut stand = Stand::ready("report_freeze");
    let fault = "report_freeze, port = 'all', duration_s = 1.0";
    let expected = [FaultCode::ReportFrozen, FaultCode::JointStuck];
    stand.stopped_by(fault, &expected);
    stand.recovers();
}

#[test]
fn fault_16_a_clock_that_jumps_wraps_or_drifts_is_followed() {
    let mut stand = Stand::ready("report_clock");
    for kind in [
        "report_time_jump, by_s = -0.8",
        "report_time_jump, by_s = -0.2",
        "report_time_jump, by_s = 3.0",
        "report_time_wrap",
        "report_time_drift, ppm = 200, duration_s = 1.5",
    ] {
        stand.inject(kind);
        stand.throws();
    }
    stand.finish();
}

#[test]
fn fault_17_broken_reports_are_dropped_and_too_many_in_a_row_slow_the_motion() {
    let mut stand = Stand::ready("report_broken");
    for kind in [
        "report_nan, frames = 2, joint = 2",
        "report_infinity, frames = 2, joint = 5",
        "report_truncated, frames = 1, keep_bytes = 60",
        "report_length, frames = 1, claim_bytes = 12",
    ] {
        stand.inject(kind);
        stand.throws();
    }
    stand.stopped_by(
        "report_nan, frames = 200, joint = 2",
        &[FaultCode::ReportBroken],
    );
    let flight = stand.recovers();
    let broken = flight.total(|c| c.input.broken_reports);
    assert!(broken >= 10, "{broken}");
    assert_eq!(flight.causes[0].path, 1, "{:?}", flight.causes[0]);
}

/// The bring-up is refused with words that say why, and nothing is brought up.
fn refuses_to_bring_up(stand: &mut Stand, expected: FaultCode, words: &[&str]) {
    let (fault, message) = stand.refused(&ControllerRequest::Bringup);
    assert_eq!(fault, expected, "{message}");
    assert!(words.iter().all(|w| message.contains(w)), "{message}");
    let refused = stand.refused(&ControllerRequest::Acknowledge);
    assert_eq!(refused.0, FaultCode::WrongMode, "nothing was brought up");
}

#[test]
fn fault_18_a_firmware_without_the_reports_needed_is_refused() {
    let old = ArmConfig {
        firmware: Firmware(1, 12, 0),
        ..ArmConfig::default()
    };
    let mut stand = Stand::with("old", old, |_| ());
    refuses_to_bring_up(&mut stand, FaultCode::UnsupportedFirmware, &["v1.12.0"]);
    stand.finish();
}

/// A line between controller and arm that passes everything on, with a `lie`. Its port.
fn a_line_that_lies(arm_port: u16, lie: fn(&mut [u8])) -> u16 {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = listener.local_addr().unwrap().port();
    std::thread::spawn(move || {
        for near in listener.incoming().map_while(Result::ok) {
            let Ok(far) = TcpStream::connect((Ipv4Addr::LOCALHOST, arm_port)) else {
                return;
            };
            for (mut from, mut to) in [
                (near.try_clone().unwrap(), far.try_clone().unwrap()),
                (far, near),
            ] {
                std::thread::spawn(move || {
                    let mut bytes = [0; 2048];
                    while let Ok(n @ 1..) = from.read(&mut bytes) {
                        lie(&mut bytes[..n]);
                        if to.write_all(&bytes[..n]).is_err() {
                            break;
                        }
                    }
                    let _ = to.shutdown(Shutdown::Both);
                });
            }
        }
    });
    port
}

#[test]
fn fault_18_reports_of_another_layout_than_the_firmwares_are_refused() {
    fn newer(bytes: &mut [u8]) {
        if let Some(at) = bytes.windows(6).position(|w| w == b"v2.7.1") {
            bytes[at..at + 6].copy_from_slice(b"v2.8.2");
        }
    }
    let mut stand = Stand::with("liar", ArmConfig::default(), |config| {
        config.command_port = a_line_that_lies(config.command_port, newer);
    });
    let words = ["v2.8.2", "574", "587"];
    refuses_to_bring_up(&mut stand, FaultCode::UnsupportedFirmware, &words);
    stand.finish();
}

/// The arm takes a new speed limit and then says that it has none.
#[test]
fn a_speed_limit_that_is_no_number_is_not_set() {
    fn no_number(bytes: &mut [u8]) {
        // Register 233, its status and its value.
        if bytes.len() == 12 && bytes[6] == 233 {
            bytes[8..].copy_from_slice(&f32::NAN.to_le_bytes());
        }
    }
    let mut stand = Stand::with("nan", ArmConfig::default(), |config| {
        config.on_difference = OnDifference::Set;
        config.command_port = a_line_that_lies(config.command_port, no_number);
    });
    refuses_to_bring_up(&mut stand, FaultCode::ArmDiffers, &["1.320", "NaN"]);
    stand.finish();
}

#[test]
fn an_arm_that_does_not_prove_to_be_simulated_is_not_driven_as_one() {
    fn real(bytes: &mut [u8]) {
        if let Some(at) = bytes.windows(9).position(|w| w == b"SIMULATED") {
            bytes[at..at + 9].copy_from_slice(b"XS1305000");
        }
    }
    let mut stand = Stand::with("tunnel", ArmConfig::default(), |config| {
        config.command_port = a_line_that_lies(config.command_port, real);
    });
    let words = ["does not prove", "simulated = true"];
    refuses_to_bring_up(&mut stand, FaultCode::ArmDiffers, &words);
    stand.finish();
}

#[test]
fn an_arm_without_a_real_time_report_is_brought_up_with_a_warning() {
    let nobody = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let port = nobody.local_addr().unwrap().port();
    drop(nobody);
    let mut stand = Stand::ready_with("no_realtime", |config| config.report_port = port);
    let ControllerEvent::Status { warnings, .. } = stand.ask(&ControllerRequest::Status) else {
        panic!("no status");
    };
    let told = warnings.join("; ");
    let fallback = stand.config.fallback_report_port;
    for word in [
        format!("no report from the arm at 127.0.0.1:{port}"),
        format!("those that port {fallback} reports"),
    ] {
        assert!(told.contains(&word), "{told}");
    }
    stand.finish();
}

#[test]
fn fault_18_another_report_on_the_port_of_the_joint_reports_is_refused() {
    let mut stand = Stand::with("ports", ArmConfig::default(), |config| {
        config.report_port = config.fallback_report_port;
    });
    refuses_to_bring_up(&mut stand, FaultCode::UnsupportedFirmware, &["135", "784"]);
    stand.finish();
}

/// Changes the byte of a status report at `at`.
fn change(bytes: &mut [u8], at: usize, to: impl Fn(u8) -> u8) {
    if let Some(byte) = bytes.get_mut(at) {
        *byte = to(*byte);
    }
}

/// The lies are where the vendor's report table has the mode, the enabled joints, reduced
/// mode, the collision sensitivity and the tool centre point.
#[test]
fn an_arm_is_brought_up_by_what_it_reports_and_one_that_is_refused_is_not_left_ready() {
    type Lie = fn(&mut [u8]);
    let lies: [(Lie, FaultCode, &[&str]); 5] = [
        (
            |b| change(b, 4, |state| state & 0x0F),
            FaultCode::ArmNotReady,
            &["Servo", "Position"],
        ),
        (
            |b| change(b, 88, |bits| bits & 0x7B),
            FaultCode::ArmNotReady,
            &["joint 3", "enabled"],
        ),
        (
            |b| change(b, 494, |bits| bits | 1),
            FaultCode::ArmDiffers,
            &["reduced mode"],
        ),
        // It was set to 4.
        (
            |b| change(b, 131, |_| 3),
            FaultCode::ArmDiffers,
            &["sensitivity is 3", "set a moment ago"],
        ),
        // The high byte of its x: far from where it was set to.
        (
            |b| change(b, 94, |_| 0x44),
            FaultCode::ArmDiffers,
            &["tool centre point", "set a moment ago"],
        ),
    ];
    for (lie, fault, words) in lies {
        let mut stand = Stand::with("effect", ArmConfig::default(), |config| {
            config.on_difference = OnDifference::Set;
            config.arm_settings.collision_sensitivity = Some(4);
            config.status_ports[0] = a_line_that_lies(config.status_ports[0], lie);
        });
        let mut beside = stand.other_client();
        refuses_to_bring_up(&mut stand, fault, words);
        let state = beside.state().unwrap();
        assert!(!state.can_move(), "{state:?} after {words:?}");
        stand.finish();
    }
}
