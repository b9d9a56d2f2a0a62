//! Motions, commands and limits over whole cycles, in virtual time.

use super::bench::{Bench, go, swing};
use super::*;
use crate::control::exchange::ControlCommand;
use crate::control::limiter::Limiter;
use arm_model::JointTrajectory;
use arm_model::joint::START_POSE;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use shared_types::ipc::Reports;

#[test]
fn a_trajectory_is_streamed_at_its_planned_times() {
    let mut bench = Bench::holding();
    bench.sent.clear();
    let motion = swing();
    bench.run(motion.clone());
    assert_eq!(bench.state.mode(), ControllerMode::Streaming);
    let start = bench.now_ns;
    bench.cycles_until_still();
    assert_eq!(bench.state.mode(), ControllerMode::Idle);
    let end = start + 1_200_000_000;
    assert_eq!(
        bench.events,
        [
            ControlEvent::Started {
                id: 7,
                start_ns: start
            },
            ControlEvent::Finished {
                id: 7,
                start_ns: start,
                end_ns: end
            }
        ]
    );
    for (k, q) in (0..301_u32).zip(&bench.sent) {
        let expected = motion.state_at(f64::from(k) * 0.004).q;
        assert!((*q - expected).max_abs() < 1e-9, "cycle {k}");
    }
}

#[test]
fn a_missed_cycle_costs_its_setpoint_and_no_time() {
    let mut bench = Bench::holding();
    let motion = swing();
    bench.run(motion.clone());
    let start = bench.now_ns;
    for missed in [0, 0, 2, 0, 5, 0, 1] {
        let input = bench.input(missed);
        bench.step(input);
        let t_s = f64::from(u32::try_from((bench.now_ns - start) / 1000).unwrap()) * 1e-6;
        let off = bench.commanded[0] - motion.state_at(t_s).q;
        assert!(off.max_abs() < 1e-9, "{missed}");
    }
    let last = bench.commanded[0];
    let input = bench.input(6);
    bench.step(input);
    assert_eq!(bench.latched(), Some(FaultCode::DeadlineMissed));
    assert_eq!((bench.commanded[0], bench.requests.len()), (last, 1));
}

/// A motion that begins in a late cycle keeps to the deadlines all the same: its
/// punctual setpoints lie at whole periods of it.
#[test]
fn a_motion_that_begins_late_is_on_time_from_its_second_setpoint_on() {
    let mut bench = Bench::holding();
    bench.sent.clear();
    let motion = swing();
    let mut input = bench.input(0);
    let start = input.deadline_ns;
    input.late_ns = 1_300_000;
    input.command = Some(ControlCommand::Run {
        id: 7,
        motion: Box::new(motion.clone()),
    });
    bench.step(input);
    bench.cycles_until_still();
    let end = bench.events.iter().find_map(|event| match event {
        ControlEvent::Finished {
            start_ns, end_ns, ..
        } => Some((*start_ns, *end_ns)),
        _ => None,
    });
    assert_eq!(end, Some((start, start + 1_200_000_000)));
    for (k, q) in (0..301_u32).zip(&bench.sent) {
        let t_s = if k == 0 { 0.0013 } else { f64::from(k) * 0.004 };
        let expected = motion.state_at(t_s).q;
        assert!((*q - expected).max_abs() < 1e-9, "cycle {k}");
    }
}

#[test]
fn every_fault_ends_as_its_table_says() {
    type Break = fn(&mut CycleInput);
    let cases: [(FaultCode, Break); 10] = [
        (FaultCode::OperatorStop, |i| i.operator.stop = 1),
        (FaultCode::OperatorStop, |i| {
            i.command = Some(ControlCommand::Stop)
        }),
        (FaultCode::OperatorLost, |i| i.operator.count = 1),
        (FaultCode::ReplyStalled, |i| {
            i.link.unanswered_ns = 100_000_001;
        }),
        (FaultCode::ReportStale, |i| i.reports = Reports::default()),
        (FaultCode::EncoderJump, |i| {
            for report in i.reports.as_mut_slice() {
                // Five degrees.
                report.q[2] += 0.0873;
            }
        }),
        (FaultCode::ArmError, |i| i.link.status = Some(Status(0x50))),
        (FaultCode::ArmNotReady, |i| {
            i.link.status = Some(Status(0x10));
        }),
        (FaultCode::ArmModeChanged, |i| {
            for report in i.reports.as_mut_slice() {
                report.arm_mode = 0;
            }
        }),
        (FaultCode::LinkLost, |i| i.link.lost = true),
    ];
    for (fault, spoil) in cases {
        for motion in [swing(), go()] {
            let mut bench = Bench::holding();
            bench.run(motion);
            for _ in 0..60 {
                bench.cycle();
            }
            let before = bench.sent.len();
            for _ in 0..400 {
                let mut input = bench.input(0);
                spoil(&mut input);
                bench.step(input);
            }
            let braked = bench.sent.len() - before;
            assert_eq!(bench.latched(), Some(fault));
            assert_eq!(bench.state.mode(), ControllerMode::Faulted, "{fault:?}");
            assert_eq!(
                braked > 5,
                reaction(fault).path < StopCategory::CutOff,
                "{fault:?} {braked}"
            );
            let stops = usize::from(reaction(fault).stop_arm);
            assert_eq!(bench.requests.len(), stops, "{fault:?}");
            // Nothing but an engagement wakes it.
            bench.run(swing());
            assert_eq!(bench.state.mode(), ControllerMode::Faulted);
            let hold = bench.commanded[0];
            bench.judge = Limiter::at_rest(hold, &Limits::default());
            bench.command(ControlCommand::Engage { hold });
            assert_eq!(bench.state.mode(), ControllerMode::Idle);
        }
    }
}

#[test]
fn the_first_braking_setpoint_comes_in_the_very_cycle() {
    let mut bench = Bench::holding();
    bench.run(swing());
    for _ in 0..60 {
        bench.cycle();
    }
    let last = bench.commanded[0];
    bench.command(ControlCommand::Stop);
    assert_eq!(bench.state.mode(), ControllerMode::Braking);
    let planned = swing().state_at(61.0 * 0.004).q;
    let (braked, planned) = (bench.commanded[0] - last, planned - last);
    assert!(braked.max_abs() < planned.max_abs());
}

#[test]
fn commands_that_do_not_fit_are_refused() {
    let mut bench = Bench::offline();
    bench.run(swing());
    bench.command(ControlCommand::Engage {
        hold: JointVector::splat(f64::NAN),
    });
    assert!(
        bench
            .events
            .iter()
            .all(|e| matches!(e, ControlEvent::Refused { .. }))
    );
    let mut bench = Bench::holding();
    bench.run(swing());
    bench.run(go());
    let mut bench2 = Bench::holding();
    bench2.run(Motion::Spline(
        JointTrajectory::hold(JointVector::splat(0.1), 1.0).unwrap(),
    ));
    for (bench, fault) in [
        (bench, FaultCode::WrongMode),
        (bench2, FaultCode::StartPoseMismatch),
    ] {
        let id = Some(7);
        assert!(bench.events.contains(&ControlEvent::Refused { id, fault }));
    }
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    /// Wild trajectories that no preflight saw: the limiter alone holds.
    #[test]
    fn wild_trajectories_are_braked_within_limits(
        steps in prop::collection::vec((0.004_f64..0.6, prop::array::uniform7(-1.5_f64..1.5)), 1..6),
        stop_at in 0_usize..300,
    ) {
        let mut bench = Bench::holding();
        let (mut times, mut poses) = (vec![0.0], vec![START_POSE]);
        for (dt, by) in steps {
            times.push(times[times.len() - 1] + dt);
            poses.push(START_POSE + JointVector(by));
        }
        bench.run(Motion::Spline(JointTrajectory::new(&times, &poses).unwrap()));
        for k in 0..600 {
            if k == stop_at {
                bench.command(ControlCommand::Stop);
            }
            bench.cycle();
        }
        prop_assert!(!bench.state.mode().is_moving());
    }
}
