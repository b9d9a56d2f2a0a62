//! Motions, commands and what goes wrong on the way, over whole cycles in virtual time.
//! How each fault is met is asserted on the simulated rig (`hil-tests/tests/faults`).

use super::bench::{Bench, ENGAGE, cause_in, run_command, swing};
use super::*;
use crate::control::Thresholds;
use crate::control::exchange::ControlCommand;
use arm_model::JointTrajectory;
use arm_model::joint::START_POSE;
use rand::{RngExt, SeedableRng};
use shared_types::OperatingMode;
use shared_types::ipc::{GuardianBeat, Reports};

/// A motion that begins in a late cycle keeps to the deadlines all the same: its
/// punctual setpoints lie at whole periods of it.
#[test]
fn a_trajectory_is_streamed_at_its_planned_times_also_when_it_begins_late() {
    for (late_ns, first_s) in [(0, 0.0), (1_300_000, 0.0013)] {
        let mut bench = Bench::holding();
        bench.sent.clear();
        let motion = swing();
        let mut input = bench.input(0);
        input.late_ns = late_ns;
        let (id, start_ns) = (7, input.deadline_ns);
        input.command = Some(run_command(id, motion.clone()));
        bench.step(input);
        assert_eq!(bench.state.mode(), ControllerMode::Streaming);
        bench.cycles_until_still();
        assert_eq!(bench.state.mode(), ControllerMode::Idle);
        let end_ns = start_ns + 1_200_000_000;
        let finished = ControlEvent::Finished {
            id,
            start_ns,
            end_ns,
        };
        assert_eq!(
            bench.events,
            [ControlEvent::Started { id, start_ns }, finished]
        );
        for (k, q) in (0..301_u32).zip(&bench.sent) {
            let t_s = if k == 0 {
                first_s
            } else {
                f64::from(k) * 0.004
            };
            let expected = motion.state_at(t_s).q;
            assert!((*q - expected).max_abs() < 1e-9, "cycle {k}");
        }
    }
}

#[test]
fn a_missed_cycle_costs_its_setpoint_and_no_time() {
    let mut bench = Bench::holding();
    let motion = swing();
    bench.run(motion.clone());
    let start_ns = bench.now_ns;
    for missed in [0, 0, 2, 0, 5, 0, 1] {
        let input = bench.input(missed);
        bench.step(input);
        let t_s = (bench.now_ns - start_ns) as f64 * 1e-9;
        let off = bench.commanded[0] - motion.state_at(t_s).q;
        assert!(off.max_abs() < 1e-9, "{missed}");
    }
    let last = bench.commanded[0];
    let input = bench.input(6);
    bench.step(input);
    assert_eq!(bench.latched(), Some(FaultCode::DeadlineMissed));
    assert_eq!((bench.commanded[0], bench.requests.len()), (last, 1));
}

/// Throws that use the limits fully, stopped at every eighth cycle: the brake
/// itself stays within the limits, so the arm need not stop by itself.
#[test]
fn a_throw_is_braked_softly_wherever_it_is_stopped() {
    let limits = Limits::default();
    let (mut stops, mut hard) = (0, 0);
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
    while stops < 1500 {
        let Some(throw) = throw(&mut rng, &limits) else {
            continue;
        };
        let cycles = throw.duration_s() / 0.004;
        for k in (1..).step_by(8).take_while(|k| f64::from(*k) < cycles) {
            let mut bench = Bench::holding();
            bench.run(Motion::Spline(throw));
            (1..k).for_each(|_| bench.cycle());
            bench.command(ControlCommand::Stop);
            bench.cycles_until_still();
            assert_eq!(bench.latched(), Some(FaultCode::OperatorStop));
            stops += 1;
            hard += usize::from(!bench.requests.is_empty());
        }
    }
    println!("{hard} of {stops} stops left the brake to the arm");
    assert!(hard * 20 < stops, "{hard} of {stops}");
}

/// A random three-waypoint throw within limits, 0 to 10 % below them.
fn throw(rng: &mut rand_chacha::ChaCha8Rng, limits: &Limits) -> Option<JointTrajectory> {
    let poses: Vec<JointVector> = (0..4)
        .map(|k| {
            let reach = if k == 0 { 0.0 } else { 0.7 };
            START_POSE + JointVector([0.0; 7].map(|_| reach * rng.random_range(-1.0..1.0)))
        })
        .collect();
    (4..40).find_map(|k| {
        let step_s = f64::from(k) * 0.05;
        let times = [0.0, step_s, 2.0 * step_s, 3.0 * step_s];
        let trajectory = JointTrajectory::new(&times, &poses).ok()?;
        limits
            .worst_violation(&trajectory)
            .is_none()
            .then_some(trajectory)
    })
}

/// The other benches' guardian always beats.
#[test]
fn a_guardian_that_is_not_required_may_never_come() {
    let mut bench = Bench::offline();
    let unguarded = |input: &mut CycleInput| input.guardian = GuardianBeat::default();
    bench.spoilt_cycles(101, Some(ENGAGE), unguarded);
    assert_eq!(bench.state.mode(), ControllerMode::Idle);
    // The swing takes 300 cycles; two seconds in all are four times the guardian's timeout.
    bench.spoilt_cycles(400, Some(run_command(7, swing())), unguarded);
    assert_eq!(bench.latched(), None);
    assert_eq!(bench.state.mode(), ControllerMode::Idle);
    let finished = |event: &ControlEvent| matches!(event, ControlEvent::Finished { id: 7, .. });
    assert!(bench.events.iter().any(finished));
}

/// A guardian that could not stop the arm is none, and whoever fell silent before an
/// engagement is not taken to live after it.
#[test]
fn a_motion_needs_a_guardian_that_reaches_the_arm_and_an_operator() {
    type Spoil = fn(&mut CycleInput);
    let spoilt: [(Spoil, FaultCode); 4] = [
        (|i| i.guardian.phase = 0, FaultCode::GuardianLost),
        (|i| i.guardian.connected = 0, FaultCode::GuardianLost),
        (|i| i.guardian.count = 100, FaultCode::GuardianLost),
        (|i| i.operator.count = 100, FaultCode::OperatorLost),
    ];
    for (spoil, fault) in spoilt {
        let settings = ControlSettings {
            guardian_required: true,
            ..Thresholds::relaxed().into()
        };
        let mut bench = Bench::holding_with(settings);
        bench.command(ControlCommand::Stop);
        bench.spoilt_cycles(200, None, spoil);
        bench.spoilt_cycles(5, Some(ENGAGE), spoil);
        assert_eq!(bench.state.mode(), ControllerMode::Idle);
        bench.spoilt_cycles(1, Some(run_command(8, swing())), spoil);
        let id = Some(8);
        assert_eq!(
            bench.events.last(),
            Some(&ControlEvent::Refused { id, fault })
        );
        bench.command(run_command(9, swing()));
        assert_eq!(bench.state.mode(), ControllerMode::Streaming, "{fault:?}");
        bench.spoilt_cycles(400, None, spoil);
        assert_eq!(bench.state.summary().fault, fault as u16);
    }
}

/// The guardian stops an arm that a brake cannot reach any more, whatever began the brake.
#[test]
fn a_link_that_fails_during_a_brake_is_published_beside_the_first_cause() {
    let mut bench = Bench::holding();
    bench.run(swing());
    bench.cycles(61);
    bench.cycle_with(|input| input.operator.released = 1);
    assert_eq!(bench.state.mode(), ControllerMode::Braking);
    assert_eq!(bench.state.summary().link_failed, 0);
    bench.cycle_with(|input| input.link.lost = true);
    let state = bench.state.summary();
    let found = (state.mode, state.fault, state.link_failed);
    let fault = FaultCode::DeadManReleased as u16;
    assert_eq!(found, (ControllerMode::Faulted as u8, fault, 1));
    let mut engage = bench.input(0);
    engage.command = Some(ENGAGE);
    bench.state.step(engage);
    assert_eq!(bench.state.summary().link_failed, 0);
}

/// Velocities hold no pose by themselves: what was last reported must not drive the arm on.
#[test]
fn without_reports_joint_velocities_hold_nothing_and_the_controller_latches() {
    let settings = ControlSettings {
        interface: CommandInterface::JointVelocity,
        ..Thresholds::relaxed().into()
    };
    let mut bench = Bench::of(settings);
    bench.commanded = [START_POSE + JointVector([0.01; 7]); 3];
    bench.command(ENGAGE);
    let velocity = |bench: &mut Bench, blind: bool| {
        let mut input = bench.input(0);
        input
            .reports
            .as_mut_slice()
            .iter_mut()
            .for_each(|r| r.arm_mode = 4);
        if blind {
            input.reports = Reports::default();
        }
        let out = bench.state.step(input);
        bench.events.extend(out.events);
        match out.command {
            Some(ArmCommand::Velocity { qd, .. }) => Some(qd.max_abs()),
            Some(ArmCommand::Position(_)) => panic!("a position"),
            None => None,
        }
    };
    let driven = (0..50).filter_map(|_| velocity(&mut bench, false)).last();
    assert!(driven.is_some_and(|qd| qd > 0.03), "{driven:?}");
    let blind: Vec<_> = (0..50).map(|_| velocity(&mut bench, true)).collect();
    assert_eq!(bench.latched(), Some(FaultCode::ReportStale));
    let sent = blind.iter().flatten().count();
    assert!((20..=26).contains(&sent), "100 ms of reports: {sent}");
}

#[test]
fn a_stop_without_a_held_arm_is_answered() {
    let mut bench = Bench::offline();
    bench.command(ControlCommand::Stop);
    assert_eq!(bench.events, [ControlEvent::AtRest]);
    // On the heels of an engagement it is met.
    bench.command(ENGAGE);
    bench.command(ControlCommand::Stop);
    assert_eq!(bench.latched(), Some(FaultCode::OperatorStop));
}

/// A stop on the way of a slowed motion makes it a brake, which ends earlier, and the
/// first cause stays the cause.
#[test]
fn a_slowed_motion_is_braked_when_something_worse_comes() {
    let slowed = |second: FaultCode| {
        let mut bench = Bench::holding();
        bench.run(swing());
        bench.cycles(61);
        let stop_ns = bench.now_ns + 120_000_000;
        for _ in 0..300 {
            let mut input = bench.input(0);
            input.reports = Reports::default();
            let stops = second == FaultCode::OperatorStop && input.deadline_ns > stop_ns;
            input.operator.stop = u32::from(stops);
            bench.step(input);
        }
        let cause = cause_in(&bench.events).unwrap();
        assert_eq!(cause.fault(), FaultCode::ReportStale);
        assert_eq!(cause.second_code, second as u16);
        assert_eq!(bench.requests.len(), 0);
        cause.rest_cycle
    };
    assert!(slowed(FaultCode::OperatorStop) < slowed(FaultCode::None));
}

#[test]
fn an_operating_mode_slows_nobody_down_silently_but_stops_what_is_too_fast() {
    let mut bench = Bench::holding_with(ControlSettings {
        arming_required: true,
        ..Thresholds::relaxed().into()
    });
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

/// A stall lets nothing pile up.
#[test]
fn a_stall_holds_setpoints_back() {
    let strict = Thresholds::strict();
    let mut bench = Bench::holding_with(strict);
    bench.run(swing());
    bench.cycles(40);
    let sent = bench.sent.len();
    bench.cycle_with(|input| input.link.unanswered = strict.unanswered_max);
    assert_eq!(bench.sent.len(), sent, "held back");
    assert_eq!(bench.state.counts().skipped, 1);
}

/// An engagement on its way when the arm is stopped was meant for another state of
/// the world.
#[test]
fn a_stop_is_not_acknowledged_by_what_was_ordered_before_it() {
    let mut bench = Bench::holding();
    bench.run(swing());
    bench.cycles(60);
    bench.spoilt_cycles(1, Some(ENGAGE), |input| {
        input.link.status = Some(Status(0x50));
    });
    assert_eq!(bench.state.mode(), ControllerMode::Faulted);
    assert_eq!(bench.latched(), Some(FaultCode::ArmError));
    let fault = FaultCode::WrongMode;
    let refused = ControlEvent::Refused { id: None, fault };
    assert!(bench.events.contains(&refused));
}
