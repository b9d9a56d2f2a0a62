//! The operator lets go or withdraws the arming: 36.

use super::limits;
use super::stage::{INTERFACES, Stage, fastest_through};
use arm_model::limits::LimitsSpec;
use arm_model::{JointTrajectory, JointVector, Limits};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rt_controller::control::reaction::StopCategory;
use rt_controller::control::{ControlCommand, ControlEvent, Motion};
use shared_types::ipc::ControllerMode;
use shared_types::{CommandInterface, FaultCode};

/// Limits that a throw of each interface uses fully. An arm that follows velocities
/// makes its own jerk and cannot follow steps of the full acceleration closely.
fn limits_of(via: CommandInterface) -> Limits {
    let limits = Limits::default();
    match via {
        CommandInterface::ServoPosition => limits,
        CommandInterface::JointVelocity => Limits::try_from(LimitsSpec {
            acceleration_max_rad_s2: limits.acceleration_max_rad_s2 * 0.5,
            ..limits.into()
        })
        .unwrap(),
    }
}

/// A random throw from `from` with four waypoints, as fast as `limits` allow to
/// ten milliseconds.
fn random_throw(from: JointVector, limits: &Limits, rng: &mut ChaCha8Rng) -> JointTrajectory {
    loop {
        let mut away = || from + JointVector([0.0; 7].map(|_| rng.random_range(-0.7..0.7)));
        let poses = [from, away(), away(), away()];
        if let Some(throw) = fastest_through(&poses, limits, 0.01, 20..200) {
            return throw;
        }
    }
}

/// How the operator takes the arm back.
#[derive(Debug, Clone, Copy)]
enum Withdrawal {
    LetsGo,
    Disarms,
    Stops,
}

impl Withdrawal {
    fn happens(self, stage: &mut Stage) -> FaultCode {
        match self {
            Self::LetsGo => {
                stage.rig.dead_man_released = true;
                FaultCode::DeadManReleased
            }
            Self::Disarms => {
                stage.rig.command(ControlCommand::Disarm);
                FaultCode::Disarmed
            }
            Self::Stops => {
                stage.rig.operator_stop = true;
                FaultCode::OperatorStop
            }
        }
    }
}

/// Stops `stage` after `part` of its throw; asserts that the very next cycle
/// brakes and that everything to standstill is within limits.
fn assert_braked_at(stage: &mut Stage, how: Withdrawal, part: f64) {
    stage.run_fraction(part);
    stage.assert_mode(ControllerMode::Streaming);
    let last = *stage.rig.log.records.last().unwrap();
    let before = last.cycle;
    let fault = how.happens(stage);
    stage.rig.run_cycles(1);
    let first = *stage.rig.log.records.last().unwrap();
    assert_eq!(first.cycle, before + 1);
    assert_eq!((first.sent, first.mode), (1, ControllerMode::Braking as u8));
    // A stop may stay on the path, but later there than planned.
    let planned_s = last.trajectory_s + Limits::default().period_s();
    let planned = stage.throw.state_at(planned_s);
    let off_rad = (first.q_c - planned.q).max_abs();
    let moves = planned.qd.max_abs() > 0.1;
    assert!(!moves || off_rad > 1e-12, "{how:?} at {part}: as planned");
    stage.rig.run_for(0.8);
    let [cause] = stage.rig.log.causes[..] else {
        panic!("{how:?} at {part}: {:?}", stage.rig.log.causes);
    };
    let braked = (fault, StopCategory::JointSpace as u8);
    assert_eq!((cause.fault(), cause.path), braked);
    let at_once = (before + 1, 0, 0);
    let found = (cause.cycle, cause.stop_arm, cause.second_code);
    assert_eq!(found, at_once, "{cause:?}");
    assert_eq!(stage.rig.mode(), ControllerMode::Faulted);
    limits::assert_kept(stage, limits::EVER, 0.0);
    assert!(stage.speed() < 1e-3, "{}", stage.speed());
}

#[test]
fn fault_36_the_arm_is_braked_within_a_cycle_at_1000_random_moments_of_fast_throws() {
    let moments = |seed: u64, via| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut throw = None;
        for k in 0..500 {
            let mut stage = Stage::ready(via, "");
            // Ten moments of each throw.
            if k % 10 == 0 {
                let from = stage.rig.commanded();
                throw = Some(random_throw(from, &limits_of(via), &mut rng));
            }
            stage.throw = throw.unwrap();
            stage.begin();
            let how = if rng.random_bool(0.5) {
                Withdrawal::LetsGo
            } else {
                Withdrawal::Disarms
            };
            let part = rng.random_range(0.0..0.97);
            assert_braked_at(&mut stage, how, part);
        }
    };
    std::thread::scope(|scope| {
        for (seed, via) in (36..).zip(INTERFACES) {
            scope.spawn(move || moments(seed, via));
        }
    });
}

/// The whole judgement, for each withdrawal and each interface.
#[test]
fn fault_36_nothing_moves_until_the_operator_acknowledges_and_arms_again() {
    for via in INTERFACES {
        for how in [Withdrawal::LetsGo, Withdrawal::Disarms, Withdrawal::Stops] {
            let mut stage = Stage::throwing(via, "");
            assert_braked_at(&mut stage, how, 0.55);
            stage.rig.operator_stop = false;
            let fault = stage.rig.log.causes[0].fault();
            stage.assert_stop(super::judge::braked(fault));
            stage.assert_works_again();
        }
    }
}

/// With the switch let go nothing is armed and nothing begins; an arming ends
/// with it.
#[test]
fn fault_36_a_switch_that_is_let_go_disarms_and_refuses() {
    for via in INTERFACES {
        let mut stage = Stage::ready(via, "");
        stage.arm();
        stage.rig.run_cycles(2);
        stage.rig.dead_man_released = true;
        stage.rig.run_cycles(1);
        let fault = FaultCode::DeadManReleased;
        let (_, last) = *stage.rig.log.events.last().unwrap();
        assert_eq!(last, ControlEvent::Disarmed { fault });
        stage.arm();
        stage.rig.run_cycles(1);
        assert_eq!(*stage.refusals().last().unwrap(), (None, fault));
        stage.rig.dead_man_released = false;
        stage.rig.start(Motion::Spline(stage.throw));
        stage.rig.run_cycles(2);
        stage.assert_refused(FaultCode::NotArmed);
    }
}
