//! The command link: stalls, resets, half-open connections, a pulled cable,
//! replies in the wrong order or with bits set.

use super::stand::{Stand, at_speed};
use rt_controller::ControllerConfig;
use rt_controller::xarm::ArmState;
use shared_types::FaultCode;
use xarm_sim::{ArmConfig, ArmEvent};

/// The profile's own patience with the link: a silence of 100 ms, 25 setpoints.
fn impatient(config: &mut ControllerConfig) {
    config.thresholds.reply_stall_ms = None;
    config.thresholds.unanswered_max = None;
}

/// Whether the arm's state became "stopped".
fn was_stopped(event: &ArmEvent) -> bool {
    matches!(
        event,
        ArmEvent::State {
            state: ArmState::Stopped,
            ..
        }
    )
}

#[test]
fn fault_01_a_stall_of_190_ms_stops_without_a_burst() {
    let mut stand = Stand::with("stall", ArmConfig::default(), impatient);
    stand.make_ready();
    let script = at_speed("kind = \"stall\"\nduration_s = 0.19");
    stand.stopped_by(&script, &[FaultCode::ReplyStalled]);
    let flight = stand.recovers();
    let began = flight
        .arm
        .iter()
        .find(|e| matches!(e.event, ArmEvent::Fault { begins: true, .. }))
        .unwrap()
        .at;
    let after = |e: &&xarm_sim::TimedEvent| (0.0..1.0).contains(&e.at.since_s(began));
    let late = flight.arm.iter().filter(after);
    let held = late
        .clone()
        .filter(|e| matches!(e.event, ArmEvent::Setpoint(_)))
        .count();
    assert!(held <= 26, "{held} setpoints waited in the link");
    assert!(late.clone().any(|e| was_stopped(&e.event)), "asked to stop");
    assert!(
        !late.clone().any(|e| matches!(e.event, ArmEvent::Error(_))),
        "the arm itself had nothing to complain of"
    );
}

#[test]
fn fault_01_a_stall_of_30_ms_is_absorbed() {
    let mut stand = Stand::ready("short_stall");
    stand.inject(&at_speed("kind = \"stall\"\nduration_s = 0.03"));
    stand.throws();
    stand.finish();
}

#[test]
fn fault_04_a_reset_connection_is_met_by_the_guardian_and_never_resumed() {
    let mut stand = Stand::ready("reset");
    let script = at_speed("kind = \"connection_reset\"\nports = \"commands\"");
    stand.stopped_by(&script, &[FaultCode::LinkLost]);
    stand.works_again();
    let guardian = stand.guardian.as_ref().unwrap().log();
    assert!(guardian.contains("the arm is asked to stop"), "{guardian}");
    let flight = stand.finish();
    assert!(
        flight.arm.iter().any(|e| was_stopped(&e.event)),
        "by state 4"
    );
}

#[test]
fn fault_05_a_half_open_connection_is_noticed_and_the_arm_stopped_on_another() {
    let mut stand = Stand::with("half_open", ArmConfig::default(), impatient);
    stand.make_ready();
    let script = at_speed("kind = \"half_open\"\nports = \"commands\"");
    stand.stopped_by(&script, &[FaultCode::ReplyStalled]);
    let seen = stand.arm.events();
    stand.wait_until("the guardian's stop", |_| {
        let all = seen.since(shared_types::MonotonicNs(0));
        all.iter().rev().any(|e| was_stopped(&e.event))
    });
    stand.recovers();
}

#[test]
fn fault_06_a_pulled_cable_that_comes_back_resumes_nothing() {
    let mut stand = Stand::with("cable", ArmConfig::default(), impatient);
    stand.make_ready();
    let script = at_speed("kind = \"cable_pull\"\nduration_s = 0.5");
    let expected = [
        FaultCode::ReplyStalled,
        FaultCode::ReportStale,
        FaultCode::ReportFrozen,
    ];
    stand.stopped_by(&script, &expected);
    let flight = stand.recovers();
    assert!(
        flight.arm.iter().any(|e| was_stopped(&e.event)),
        "by state 4"
    );
}

#[test]
fn fault_07_replies_in_another_order_or_twice_are_counted_and_change_nothing() {
    let mut stand = Stand::ready("replies");
    for kind in ["replies_reordered", "replies_duplicated"] {
        stand.inject(&at_speed(&format!("kind = \"{kind}\"\nduration_s = 1.0")));
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
    stand.inject(&at_speed("kind = \"warning_bit\"\nduration_s = 0.4"));
    stand.throws();
    let script = at_speed("kind = \"error_bit\"\nduration_s = 0.4");
    stand.stopped_by(&script, &[FaultCode::ArmError]);
    stand.make_ready();
    let script = at_speed("kind = \"not_ready_bit\"\nduration_s = 0.4");
    stand.stopped_by(&script, &[FaultCode::ArmNotReady]);
    let flight = stand.recovers();
    assert!(
        flight.causes[0].counts.warnings >= 50,
        "{:?}",
        flight.causes[0]
    );
}
