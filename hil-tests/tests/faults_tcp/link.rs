//! The command link: stalls, resets, half-open connections, a pulled cable,
//! replies in the wrong order or with bits set.

use super::flight::was_stopped;
use super::stand::Stand;
use rt_controller::ControllerConfig;
use shared_types::{FaultCode, MonotonicNs};
use xarm_sim::{ArmEvent, TimedEvent};

/// The profile's own patience with the link: a silence of 100 ms, 25 setpoints.
fn impatient(config: &mut ControllerConfig) {
    config.thresholds.reply_stall_ms = None;
    config.thresholds.unanswered_max = None;
}

#[test]
fn fault_01_a_stall_of_190_ms_stops_without_a_burst() {
    let mut stand = Stand::ready_with("stall", impatient);
    stand.stopped_by("stall, duration_s = 0.19", &[FaultCode::ReplyStalled]);
    let flight = stand.recovers();
    let began = flight
        .arm
        .iter()
        .find(|e| matches!(e.event, ArmEvent::Fault { begins: true, .. }))
        .unwrap()
        .at;
    let after = |e: &&TimedEvent| (0.0..1.0).contains(&e.at.since_s(began));
    let late: Vec<&TimedEvent> = flight.arm.iter().filter(after).collect();
    let held = |e: &&&TimedEvent| matches!(e.event, ArmEvent::Setpoint(_));
    let held = late.iter().filter(held).count();
    assert!(held <= 26, "{held} setpoints waited in the link");
    assert!(late.iter().any(|e| was_stopped(e)), "asked to stop");
    let complains = late.iter().any(|e| matches!(e.event, ArmEvent::Error(_)));
    assert!(!complains, "the arm itself had nothing to complain of");
}

#[test]
fn fault_01_a_stall_of_30_ms_is_absorbed() {
    let mut stand = Stand::ready("short_stall");
    stand.inject("stall, duration_s = 0.03");
    stand.throws();
    stand.finish();
}

#[test]
fn fault_04_a_reset_connection_is_met_by_the_guardian_and_never_resumed() {
    let mut stand = Stand::ready("reset");
    stand.stopped_by(
        "connection_reset, ports = 'commands'",
        &[FaultCode::LinkLost],
    );
    stand.works_again();
    let guardian = stand.guardian.as_ref().unwrap().log();
    assert!(guardian.contains("the arm is asked to stop"), "{guardian}");
    let flight = stand.finish();
    assert!(flight.arm.iter().any(was_stopped), "by state 4");
}

#[test]
fn fault_05_a_half_open_connection_is_noticed_and_the_arm_stopped_on_another() {
    let mut stand = Stand::ready_with("half_open", impatient);
    stand.stopped_by("half_open, ports = 'commands'", &[FaultCode::ReplyStalled]);
    let seen = stand.arm.events();
    stand.wait_until("the guardian's stop", |_| {
        seen.since(MonotonicNs(0)).iter().any(was_stopped)
    });
    stand.recovers();
}

#[test]
fn fault_06_a_pulled_cable_that_comes_back_resumes_nothing() {
    let mut stand = Stand::ready_with("cable", impatient);
    let fault = "cable_pull, duration_s = 0.5";
    let expected = [
        FaultCode::ReplyStalled,
        FaultCode::ReportStale,
        FaultCode::ReportFrozen,
    ];
    stand.stopped_by(fault, &expected);
    let flight = stand.recovers();
    assert!(flight.arm.iter().any(was_stopped), "by state 4");
}

#[test]
fn fault_07_replies_in_another_order_or_twice_are_counted_and_change_nothing() {
    let mut stand = Stand::ready("replies");
    for kind in ["replies_reordered", "replies_duplicated"] {
        stand.inject(&format!("{kind}, duration_s = 1.0"));
        stand.throws();
    }
    let flight = stand.finish();
    let reordered = flight.total(|c| c.input.link.out_of_order.into());
    let twice = flight.total(|c| c.input.link.duplicates.into());
    assert!(reordered >= 50, "{reordered}");
    assert!(twice >= 100, "{twice}");
    assert_eq!(flight.total(|c| c.input.link.foreign.into()), 0);
}

#[test]
fn fault_08_a_warning_bit_is_counted_and_an_error_bit_stops() {
    let mut stand = Stand::ready("bits");
    stand.inject("warning_bit, duration_s = 0.4");
    stand.throws();
    stand.stopped_by("error_bit, duration_s = 0.4", &[FaultCode::ArmError]);
    stand.make_ready();
    stand.stopped_by("not_ready_bit, duration_s = 0.4", &[FaultCode::ArmNotReady]);
    let flight = stand.recovers();
    assert!(
        flight.causes[0].counts.warnings >= 50,
        "{:?}",
        flight.causes[0]
    );
}
