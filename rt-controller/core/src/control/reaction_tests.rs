//! What is wrong with arm, operator or machine, over whole cycles in virtual time.

use super::bench::{Bench, cause_in, swing};
use super::*;
use crate::control::Thresholds;
use crate::control::exchange::ControlCommand;
use crate::control::limiter::Limiter;
use arm_model::joint::START_POSE;
use shared_types::ipc::{GuardianBeat, JointReport, Reports};

/// Spoils the reports of a swing from its begin and gives the cause.
fn swing_with(mut spoil: impl FnMut(usize, &mut JointReport)) -> Vec<ControlEvent> {
    let mut bench = Bench::holding();
    bench.run(swing());
    for k in 0..300 {
        let mut input = bench.input(0);
        for report in input.reports.as_mut_slice() {
            spoil(k, report);
        }
        bench.step(input);
    }
    bench.events
}

/// The other benches' guardian always beats.
#[test]
fn a_guardian_that_is_not_required_may_never_come() {
    let mut bench = Bench::offline();
    let settings = ControlSettings {
        guardian_required: false,
        ..Thresholds::relaxed().into()
    };
    bench.state = ControlState::new(Limits::default(), settings);
    let cycles = |bench: &mut Bench, mut command: Option<ControlCommand>, count: usize| {
        for _ in 0..count {
            let mut input = bench.input(0);
            input.guardian = GuardianBeat::default();
            input.command = command.take();
            bench.step(input);
        }
    };
    let engage = ControlCommand::Engage { hold: START_POSE };
    cycles(&mut bench, Some(engage), 101);
    assert_eq!(bench.state.mode(), ControllerMode::Idle);
    let run = ControlCommand::Run {
        id: 7,
        motion: Box::new(swing()),
    };
    // The swing takes 300 cycles; two seconds in all are four times the guardian's timeout.
    cycles(&mut bench, Some(run), 400);
    assert_eq!(bench.latched(), None);
    assert_eq!(bench.state.mode(), ControllerMode::Idle);
    let finished = |event: &ControlEvent| matches!(event, ControlEvent::Finished { id: 7, .. });
    assert!(bench.events.iter().any(finished));
}

#[test]
fn what_is_wrong_with_an_arm_is_told_apart() {
    // Creeps away from its path.
    let events = swing_with(|k, report| report.q[6] += 0.001 * k as f64);
    let cause = cause_in(&events).unwrap();
    assert_eq!(cause.fault(), FaultCode::TrackingError);
    assert_eq!(cause.limit.joint, 7);
    assert!(cause.limit.value > 0.05 && cause.limit.limit == 0.05);
    // One joint stands still.
    let cause = cause_in(&swing_with(|_, report| report.q[5] = START_POSE[5])).unwrap();
    assert_eq!(cause.fault(), FaultCode::JointStuck);
    assert_eq!(cause.limit.joint, 6);
    // Everything stands still, to the bit.
    let mut frozen = None;
    let events = swing_with(|_, report| report.q = *frozen.get_or_insert(report.q));
    assert_eq!(cause_in(&events).unwrap().fault(), FaultCode::ReportFrozen);
    // Nonsense in every report.
    let cause = cause_in(&swing_with(|_, report| report.qd[0] = f64::NAN)).unwrap();
    assert_eq!(cause.fault(), FaultCode::ReportBroken);
    assert_eq!(
        (cause.limit.value, cause.counts.broken_reports > 4),
        (5.0, true)
    );
    // A clock that jumps to and fro.
    let events = swing_with(|k, report| report.stamp_ns -= 60_000_000 * (k as u64 % 2));
    assert_eq!(cause_in(&events).unwrap().fault(), FaultCode::ReportClock);
    // The arm's own target is somebody else's.
    let events = swing_with(|_, report| {
        report.arm_clock = 1;
        report.q_target = JointVector::ZERO;
    });
    assert_eq!(
        cause_in(&events).unwrap().fault(),
        FaultCode::SecondCommander
    );
    assert_eq!(cause_in(&swing_with(|_, _| ())), None);
}

/// A slowed swing stays on its path; a stop on the way makes it a brake, and
/// the first cause stays the cause.
#[test]
fn a_slowed_motion_keeps_to_its_path_unless_something_worse_comes() {
    for worse_after in [None, Some(5)] {
        let mut bench = Bench::holding();
        bench.run(swing());
        (0..60).for_each(|_| bench.cycle());
        let input = bench.input(0);
        let report_ns = input.deadline_ns;
        bench.step(input);
        for _ in 0..300 {
            let mut input = bench.input(0);
            input.reports = Reports::default();
            if worse_after.is_some() && input.deadline_ns > report_ns + 120_000_000 {
                input.operator.stop = 1;
            }
            bench.step(input);
            let q = bench.commanded[0];
            let near = (0..2400)
                .map(|i| (swing().state_at(f64::from(i) * 0.0005).q - q).max_abs())
                .fold(f64::INFINITY, f64::min);
            if worse_after.is_none() {
                assert!(near < 1e-3, "{near}");
            }
        }
        let cause = cause_in(&bench.events).unwrap();
        assert_eq!(cause.fault(), FaultCode::ReportStale);
        let second = worse_after.map_or(0, |_| FaultCode::OperatorStop as u16);
        assert_eq!(cause.second_code, second);
        assert_eq!(bench.requests.len(), 0);
    }
}

fn armed_bench() -> Bench {
    let mut bench = Bench::offline();
    let settings = ControlSettings {
        arming_required: true,
        ..Thresholds::relaxed().into()
    };
    bench.state = ControlState::new(Limits::default(), settings);
    bench.command(ControlCommand::Engage { hold: START_POSE });
    (0..100).for_each(|_| bench.cycle());
    bench.events.clear();
    bench
}

fn throw_arming(bench: &Bench) -> ControlCommand {
    ControlCommand::Arm(shared_types::Arming {
        operating_mode: OperatingMode::Throw,
        expires_ns: bench.now_ns + 8_000_000_000,
        area_clear: true,
    })
}

#[test]
fn a_throw_is_armed_for_one_shot_and_nothing_re_arms_it() {
    let mut bench = armed_bench();
    let refused = |fault| ControlEvent::Refused { id: Some(7), fault };
    bench.run(swing());
    assert_eq!(bench.events, [refused(FaultCode::NotArmed)]);
    let command = throw_arming(&bench);
    bench.command(command);
    bench.run(swing());
    bench.cycles_until_still();
    assert!(bench.events.contains(&ControlEvent::Disarmed {
        fault: FaultCode::None
    }));
    bench.events.clear();
    bench.run(swing());
    assert_eq!(bench.events, [refused(FaultCode::NotArmed)]);
    // Expiry and the dead-man switch disarm while idle.
    for released in [0, 1] {
        let command = throw_arming(&bench);
        bench.command(command);
        let mut input = bench.input(0);
        input.operator.released = released;
        if released == 0 {
            bench.now_ns += 8_000_000_000;
            input = bench.input(0);
        }
        bench.step(input);
        bench.events.clear();
        bench.run(swing());
        assert_eq!(bench.events, [refused(FaultCode::NotArmed)]);
    }
}

#[test]
fn a_disarmed_or_released_motion_brakes_in_the_very_cycle() {
    for (fault, released) in [(FaultCode::Disarmed, 0), (FaultCode::DeadManReleased, 1)] {
        let mut bench = armed_bench();
        let command = throw_arming(&bench);
        bench.command(command);
        bench.run(swing());
        (0..60).for_each(|_| bench.cycle());
        let mut input = bench.input(0);
        input.operator.released = released;
        if released == 0 {
            input.command = Some(ControlCommand::Disarm);
        }
        bench.step(input);
        assert_eq!(bench.state.mode(), ControllerMode::Braking);
        bench.cycles_until_still();
        assert_eq!(bench.latched(), Some(fault));
        assert_eq!(bench.requests.len(), 0);
    }
}

#[test]
fn an_operating_mode_slows_nobody_down_silently_but_stops_what_is_too_fast() {
    let mut bench = armed_bench();
    bench.command(ControlCommand::Arm(shared_types::Arming {
        operating_mode: OperatingMode::SetUp,
        expires_ns: u64::MAX,
        area_clear: false,
    }));
    bench.run(swing());
    bench.cycles_until_still();
    let cause = cause_in(&bench.events).unwrap();
    assert_eq!(cause.fault(), FaultCode::OperatingModeExceeded);
    assert!(cause.limit.value > 0.25 && cause.limit.limit == 0.25);
}

/// Late cycles slow the motion, a stall lets nothing pile up.
#[test]
fn lateness_slows_and_a_stall_holds_setpoints_back() {
    let strict = Thresholds::strict();
    let mut bench = Bench::holding();
    bench.state = ControlState::new(Limits::default(), strict);
    bench.command(ControlCommand::Engage { hold: START_POSE });
    (0..100).for_each(|_| bench.cycle());
    bench.run(swing());
    (0..40).for_each(|_| bench.cycle());
    let mut input = bench.input(0);
    input.link.unanswered = strict.unanswered_max;
    let sent = bench.sent.len();
    bench.step(input);
    assert_eq!(bench.sent.len(), sent, "held back");
    bench.judge = Limiter::at_rest(bench.commanded[0], &Limits::default());
    bench.cycle_unjudged(0);
    bench.cycle_unjudged(3);
    assert_eq!(bench.state.mode(), ControllerMode::Braking);
    (0..400).for_each(|_| bench.cycle_unjudged(0));
    let cause = cause_in(&bench.events).unwrap();
    assert_eq!(cause.fault(), FaultCode::LateCycles);
    assert_eq!((cause.path, cause.counts.skipped), (1, 1));
}

/// An engagement on its way when the arm is stopped was meant for another state of
/// the world.
#[test]
fn a_stop_is_not_acknowledged_by_what_was_ordered_before_it() {
    let mut bench = Bench::holding();
    bench.run(swing());
    (0..60).for_each(|_| bench.cycle());
    let mut input = bench.input(0);
    input.link.status = Some(Status(0x50));
    input.command = Some(ControlCommand::Engage { hold: START_POSE });
    bench.step(input);
    assert_eq!(bench.state.mode(), ControllerMode::Faulted);
    assert_eq!(bench.latched(), Some(FaultCode::ArmError));
    let fault = FaultCode::WrongMode;
    let refused = ControlEvent::Refused { id: None, fault };
    assert!(bench.events.contains(&refused));
}
