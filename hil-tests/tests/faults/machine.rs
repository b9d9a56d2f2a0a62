//! Faults of the machine and of clocks: 2, 3, 33, 34, 35.

use super::judge::{braked_and_stopped, slowed, stopped};
use super::stage::{INTERFACES, Stage, config};
use arm_model::{JointTrajectory, Limits};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::control::record::restore_input;
use rt_controller::control::{ControlSettings, ControlState, Motion, Thresholds};
use shared_types::ipc::CauseRecord;
use shared_types::{CommandInterface, FaultCode, MonotonicNs, OperatingMode};
use xarm_sim::Intake;

const MS: u64 = 1_000_000;

/// Wakes so late that one, two or three cycles are lost, at many phases.
#[test]
fn fault_02_a_single_late_wake_up_costs_its_setpoints_and_no_more() {
    for via in INTERFACES {
        for late_us in [300, 900, 2000, 3900, 4300, 6000, 7900, 8000] {
            let stage = Stage::disturbed(via, 0.5, |rig| rig.oversleep([late_us * 1000]));
            stage.assert_finished(0.0);
            let missed = stage.rig.counts().missed;
            assert_eq!(missed > 0, late_us > 800, "{late_us} us: {missed} missed");
            assert_on_time(&stage);
        }
    }
}

/// No time is lost: a setpoint is where the path is when it is sent.
fn assert_on_time(stage: &Stage) {
    let log = &stage.rig.log;
    let began = stage.on_path().next().unwrap().deadline_ns;
    for (record, input) in log.records.iter().zip(&log.inputs) {
        if record.sent == 1 && record.trajectory_s >= 0.0 {
            let at_ns = record.deadline_ns + u64::from(input.late_ns) - began;
            assert!((record.trajectory_s - at_ns as f64 * 1e-9).abs() < 1e-9);
        }
    }
}

/// Late again and again at full speed: the arm, which judges setpoints by when
/// they arrive, never sees one too far from the last.
#[test]
fn fault_02_late_wake_ups_in_a_row_never_look_too_fast_to_the_arm() {
    for via in INTERFACES {
        for first_us in [500, 1500, 2500, 3500, 3900] {
            let pairs = (0..60).flat_map(|k| [first_us * MS / 1000, (k % 4) * 900_000, 0]);
            Stage::disturbed(via, 0.2, |rig| rig.oversleep(pairs)).assert_finished(0.0);
        }
    }
}

/// Held up between its wake-up and the send, at full speed: the setpoint that
/// grew old meanwhile does not go out, so the arm never sees the next one too
/// soon after it.
#[test]
fn fault_02_a_cycle_held_up_before_its_send_never_looks_too_fast_to_the_arm() {
    for via in INTERFACES {
        for held_us in [100, 300, 500, 1500, 2500, 3500, 3900, 4500, 7000] {
            // Two cycles lost again and again are another fault's matter.
            let times = if held_us < 4000 { 40 } else { 1 };
            let often = (0..times).flat_map(|k| [held_us * 1000, (k % 4) * held_us * 250, 0, 0, 0]);
            let stage = Stage::disturbed(via, 0.2, |rig| rig.hold_up(often));
            stage.assert_finished(0.2e-3);
            let missed = stage.rig.counts().missed;
            assert_eq!(missed > 0, held_us > 200, "{held_us} us: {missed} missed");
            assert_on_time(&stage);
        }
    }
}

/// Woken late and held up as well: the setpoint that is held back lies close before the
/// next, which goes out on time.
#[test]
fn fault_02_a_late_cycle_that_is_held_up_never_looks_too_fast_to_the_arm() {
    for via in INTERFACES {
        for late_us in [300, 1500, 2700, 3400] {
            let times = |first_us: u64| (0..40).flat_map(move |_| [first_us * 1000, 0, 0, 0, 0]);
            let stage = Stage::disturbed(via, 0.2, |rig| {
                rig.oversleep(times(late_us));
                rig.hold_up(times(300));
            });
            stage.assert_finished(0.2e-3);
            let held = stage.rig.log.records.iter().filter(|r| r.held_back());
            assert!(held.count() >= 40);
            assert_on_time(&stage);
        }
    }
}

/// A setpoint that does not go out counts as missed for the one behind it.
#[test]
fn fault_02_each_setpoint_that_grows_old_is_counted_once() {
    let held_us = [0, 250, 300, 0, 0, 3500, 0, 150, 0];
    for via in INTERFACES {
        let held_ns = held_us.map(|us| us * 1000);
        let stage = Stage::disturbed(via, 0.2, |rig| rig.hold_up(held_ns));
        let records = stage.rig.log.records.iter();
        let missed: Vec<u32> = records.map(|r| r.missed).filter(|m| *m > 0).collect();
        assert_eq!(missed, [1, 2, 1], "{via:?}");
        stage.assert_finished(0.2e-3);
    }
}

/// Held up in every cycle, nothing would be sent any more: that is met as missed
/// cycles are.
#[test]
fn fault_02_a_machine_that_is_always_too_slow_stops_the_motion() {
    for via in INTERFACES {
        let stage = Stage::disturbed(via, 0.2, |rig| rig.hold_up([MS; 2000]));
        let causes = &stage.rig.log.causes;
        let faults: Vec<FaultCode> = causes.iter().map(CauseRecord::fault).collect();
        assert_eq!(faults, [FaultCode::LateCycles]);
        assert_eq!(stage.arm_errors(), [0_u8; 0]);
    }
}

#[test]
fn fault_02_three_to_five_cycles_lost_at_once_slow_the_motion_and_six_end_it() {
    // By velocities the arm has begun to brake by itself after 12 ms.
    let via = CommandInterface::ServoPosition;
    for lost in 3..=6 {
        let late_ns = 4 * lost * MS + 300_000;
        let mut stage = Stage::disturbed(via, 0.5, |rig| rig.oversleep([late_ns]));
        let (met, most) = if lost > 5 {
            (stopped(FaultCode::DeadlineMissed), 5.0)
        } else {
            (slowed(FaultCode::LateCycles), 2.0)
        };
        let cause = stage.assert_stop(met);
        assert_eq!((cause.limit.value, cause.limit.limit), (lost as f64, most));
        stage.assert_works_again();
    }
}

/// In the gap the arm has come to rest: a brake from where it was would begin
/// with a jump.
#[test]
fn fault_03_twenty_lost_cycles_end_the_motion() {
    for via in INTERFACES {
        let mut stage = Stage::disturbed(via, 0.5, |rig| rig.oversleep([80 * MS]));
        let cause = stage.assert_stop(stopped(FaultCode::DeadlineMissed));
        assert_eq!((cause.limit.value, cause.limit.limit), (20.0, 5.0));
        stage.assert_works_again();
    }
}

/// Where lost cycles are allowed for, as on a simulated arm, the arm still never
/// gets a setpoint that it cannot reach from rest.
#[test]
fn fault_03_patience_does_not_turn_a_gap_into_a_jump() {
    for via in INTERFACES {
        let mut config = config(via, "");
        config.settings = ControlSettings {
            interface: via,
            guardian_required: true,
            arming_required: true,
            ..Thresholds {
                late_cycles_max: 50,
                missed_cycles_max: 50,
                ..Thresholds::relaxed()
            }
            .into()
        };
        let mut stage = Stage::of(config);
        stage.begin();
        stage.run_fraction(0.5);
        stage.rig.oversleep([160 * MS]);
        stage.finish();
        stage.assert_stop(match via {
            CommandInterface::ServoPosition => stopped(FaultCode::DeadlineMissed),
            // Its own watchdog has stopped this arm elsewhere than it was told.
            CommandInterface::JointVelocity => braked_and_stopped(FaultCode::TrackingError),
        });
        assert_eq!(stage.arm_errors(), [0_u8; 0]);
        stage.assert_works_again();
    }
}

/// The core has no wall clock: its input is all it knows, every time in it is of
/// the monotonic clock, and what it was told makes it do the same at any hour.
#[test]
fn fault_33_a_core_that_is_told_the_same_does_the_same_at_any_hour() {
    for via in INTERFACES {
        let stage = Stage::thrown(via, "");
        let throw = stage.throw;
        let mut again = ControlState::new(Limits::default(), config(via, "").settings);
        for (input, did) in stage.rig.log.inputs.iter().zip(&stage.rig.log.records) {
            let motion = |_, _| Some(Box::new(Motion::Spline(throw)));
            let mut out = again.step(restore_input(input, motion).unwrap());
            // What the rig measured, not the core.
            out.record.wake_late_ns = did.wake_late_ns;
            out.record.compute_ns = did.compute_ns;
            out.record.send_ns = did.send_ns;
            assert_eq!(out.record, *did);
        }
        stage.assert_finished(0.0);
    }
}

/// The same throw at 95 % of its speed: what counts as punctual may come up to
/// 0.2 ms late, a twentieth of a cycle, and the arm sees that much more speed.
fn slower(throw: &JointTrajectory) -> JointTrajectory {
    let times: Vec<f64> = throw.times_s().iter().map(|t_s| t_s / 0.95).collect();
    JointTrajectory::new(&times, throw.waypoints()).unwrap()
}

/// Every wake-up late by a random time: within bounds a throw that leaves a
/// twentieth of the speed limits goes on.
#[test]
fn fault_34_a_machine_under_stress_is_borne_within_bounds() {
    for via in INTERFACES {
        for seed in 0..20 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut stage = Stage::ready(via, "");
            stage.throw = slower(&stage.throw);
            stage.begin();
            stage
                .rig
                .oversleep((0..1000).map(|_| match rng.random_range(0..100) {
                    0..80 => rng.random_range(0..200_000),
                    80..97 => rng.random_range(200_000..3_990_000),
                    _ => rng.random_range(4 * MS..6 * MS),
                }));
            stage.finish();
            stage.assert_finished(0.000_201);
            assert!(stage.rig.counts().missed > 10);
        }
    }
}

#[test]
fn fault_34_beyond_the_bounds_the_motion_is_slowed() {
    // By velocities the arm has begun to brake by itself after 12 ms.
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut stage = Stage::throwing(CommandInterface::ServoPosition, "");
        let calm = rng.random_range(20..200);
        let late = |_| rng.random_range(200_000..3_990_000);
        let jitter: Vec<u64> = (0..calm).map(late).collect();
        stage.rig.oversleep(jitter);
        stage.rig.oversleep([rng.random_range(13 * MS..19 * MS)]);
        stage.finish();
        stage.assert_stop(slowed(FaultCode::LateCycles));
    }
}

/// Two clocks a thousandth apart for a minute: setpoints slip past each other
/// evenly, and nothing else shows.
#[test]
fn fault_35_an_arm_whose_clock_is_off_by_a_thousandth_slips_evenly() {
    for via in INTERFACES {
        for ppm in [1000.0, -1000.0] {
            let mut config = config(via, "");
            config.arm.clock_ppm = ppm;
            config.arm.intake = Intake::Clock;
            let mut stage = Stage::of(config);
            stage.arm_for(OperatingMode::Wiggle);
            let from = stage.rig.commanded();
            let poses: Vec<_> = (0..13)
                .map(|k| {
                    let mut q = from;
                    q[6] += if k % 2 == 1 { 1.0 } else { 0.0 };
                    q
                })
                .collect();
            let times: Vec<f64> = (0..13).map(|k| 5.0 * f64::from(k)).collect();
            let minute = JointTrajectory::new(&times, &poses).unwrap();
            stage.rig.start(Motion::Spline(minute));
            stage.rig.run_for(61.0);
            stage.assert_one_motion(0.0);
            // 62 s are 15 500 cycles, of which a thousandth slips.
            let counters = stage.rig.with_arm(|arm| arm.model().counters());
            let slipped = counters.dropped + counters.repeated;
            assert!((10..25).contains(&slipped), "{via:?} {ppm}: {counters:?}");
            if via == CommandInterface::ServoPosition {
                assert_no_beat(&stage, &minute);
            }
        }
    }
}

/// A slip makes the arm one cycle earlier or later and is no swing: over the whole
/// minute the joint's delay stays within a cycle and a half.
fn assert_no_beat(stage: &Stage, minute: &JointTrajectory) {
    let began = stage.on_path().next().unwrap().deadline_ns;
    let (mut least, mut most) = (f64::MAX, f64::MIN);
    for sample in &stage.rig.log.truth {
        let t_s = sample.at.since_s(MonotonicNs(began));
        if !(1.0..59.0).contains(&t_s) {
            continue;
        }
        let path = minute.state_at(t_s);
        // Where the joint moves evenly, its distance tells the delay.
        if path.qd[6].abs() > 0.29 {
            let delay_s = (path.q[6] - sample.state.q[6]) / path.qd[6];
            (least, most) = (least.min(delay_s), most.max(delay_s));
        }
    }
    assert!(most - least < 0.006, "{least} to {most} s");
}
