//! Other processes die or hang, seen from the control core: 25 to 32. What the
//! processes themselves do is tested with real ones.

use super::judge::{braked, slowed};
use super::stage::{INTERFACES, Stage, nod};
use arm_model::joint::START_POSE;
use arm_model::{JointVector, Limits};
use rt_controller::control::{ControlCommand, ControlState, Motion, Thresholds};
use rt_controller::driver::CommandMsg;
use rt_controller::os::Clock;
use rt_controller::ports::rings;
use rt_controller::rt_loop::RtLoop;
use rt_controller::transport::sim::IdealArm;
use rt_controller::xarm::{ArmState, Command, StateRequest};
use shared_types::ipc::{Bus, ControllerBoards, JointReport, OperatorEnd, StateReader};
use shared_types::ipc::{ControllerMode, PAYLOAD_VERSION};
use shared_types::{CommandInterface, FaultCode, MonotonicNs, OperatingMode};
use std::cell::Cell;
use std::rc::Rc;
use xarm_sim::JointSample;

/// The plan is resident: the one who made it may die, come back in the middle of
/// the throw and want something else.
#[test]
fn fault_25_a_throw_whose_planner_is_gone_is_the_same_to_the_bit() {
    for via in INTERFACES {
        let mut stage = Stage::throwing(via, "");
        stage.run_fraction(0.5);
        let mut other = stage.throw.start();
        other[0] += 0.3;
        for _ in 0..3 {
            stage.rig.start(nod(other));
            stage.rig.run_cycles(4);
        }
        stage.finish();
        stage.assert_undisturbed();
        let refused = stage.refusals();
        assert_eq!(refused.len(), 3);
        assert!(refused.iter().all(|(_, why)| *why == FaultCode::WrongMode));
    }
}

/// A plan that never comes is no command at all: armed or not, nothing moves, and
/// the arming runs out.
#[test]
fn fault_26_without_a_whole_plan_nothing_moves_and_the_arming_runs_out() {
    for via in INTERFACES {
        let mut stage = Stage::ready(via, "");
        stage.arm();
        stage.rig.run_for(10.5);
        assert!(stage.on_path().next().is_none());
        let still = |s: &JointSample| s.state.qd.max_abs() < 1e-3;
        assert!(stage.rig.log.truth.iter().all(still));
        stage.start_nod();
        stage.rig.run_cycles(2);
        stage.assert_refused(FaultCode::NotArmed);
    }
}

/// The core knows no camera; a wiggle ends as planned whatever is filmed.
#[test]
fn fault_27_a_wiggle_ends_gently_whatever_the_camera_does() {
    for via in INTERFACES {
        let mut stage = Stage::ready(via, "");
        stage.arm_for(OperatingMode::Wiggle);
        stage.start_nod();
        stage.rig.run_for(2.0);
        stage.assert_one_motion(0.0);
        assert!(stage.speed() < 1e-3);
    }
}

/// Setpoints end in the middle of a throw. In servo mode the arm holds the last
/// one; in velocity mode it brakes by itself after `duration`. The guardian's
/// stop then finds it standing, and a new controller moves nothing.
#[test]
fn fault_28_a_controller_that_is_killed_leaves_an_arm_that_holds_or_brakes() {
    for via in INTERFACES {
        let mut stage = Stage::throwing(via, "");
        stage.run_fraction(0.55);
        let (before, commands) = (stage.rig.log.truth.len(), stage.commands());
        let speed = stage.speed();
        assert!(speed > 1.0, "{speed}");
        stage.rig.kill_controller(0.02);
        let stop = Command::SetState(StateRequest::Stop);
        stage.rig.command_from_elsewhere(&stop).unwrap();
        stage.rig.kill_controller(2.0);
        assert!(
            stage.commands() <= commands + 1,
            "one may have been under way"
        );
        let dead = &stage.rig.log.truth[before..];
        if via == CommandInterface::JointVelocity {
            // It brakes from 12 ms after the last velocity on.
            assert!(dead[60].state.qd.max_abs() < speed);
        }
        assert!(dead[400..].iter().all(|s| s.state.qd.max_abs() < 1e-3));
        assert_eq!(stage.arm_state(), ArmState::Stopped);
        // A new process knows nothing and moves nothing.
        assert_eq!(stage.rig.mode(), ControllerMode::Offline);
        stage.rig.log.causes.clear();
        stage.assert_nothing_moves_it();
        stage.assert_works_again();
    }
}

/// Without any guardian: the arm's own watchdog alone.
#[test]
fn fault_28_in_velocity_mode_the_arm_stops_by_itself() {
    let mut stage = Stage::throwing(CommandInterface::JointVelocity, "");
    stage.run_fraction(0.55);
    let (before, speed) = (stage.rig.log.truth.len(), stage.speed());
    stage.rig.kill_controller(2.0);
    let dead = &stage.rig.log.truth[before..];
    let limits = Limits::default();
    // 12 ms of the last velocity, then a brake at full acceleration.
    let brake_s = speed / limits.acceleration_max_rad_s2[0] + 0.04;
    let within = ((0.012 + brake_s + 0.06) * 1e3) as usize;
    assert!(dead[within..].iter().all(|s| s.state.qd.max_abs() < 1e-3));
    // Over 10 ms, in which the steps of its reference do not show.
    let change = |w: &[JointSample]| (w[10].state.qd - w[0].state.qd).max_abs() / 0.010;
    let hardest = dead.windows(11).map(change).fold(0.0, f64::max);
    assert!(
        hardest < 1.1 * limits.acceleration_max_rad_s2[0],
        "{hardest}"
    );
}

#[test]
fn fault_29_a_guardian_that_falls_silent_slows_the_motion() {
    for via in INTERFACES {
        let mut silent = MonotonicNs(0);
        let mut stage = Stage::disturbed(via, 0.4, |rig| {
            rig.guardian_alive = false;
            silent = rig.now();
        });
        let cause = stage.assert_stop(slowed(FaultCode::GuardianLost));
        let noticed_s = MonotonicNs(cause.stamp_ns).since_s(silent);
        assert!(noticed_s < 0.0601, "{noticed_s}");
        stage.rig.guardian_alive = true;
        stage.assert_works_again();
    }
}

/// Shared memory that cannot be had leaves a controller that nobody beats for.
#[test]
fn faults_29_and_32_without_a_guardian_or_anybody_nothing_begins() {
    for via in INTERFACES {
        for (operator_alive, silent_s) in [(true, 0.1), (false, 1.0)] {
            let mut stage = Stage::ready(via, "");
            stage.rig.operator_alive = operator_alive;
            stage.rig.guardian_alive = false;
            stage.rig.run_for(silent_s);
            stage.arm();
            stage.start_nod();
            stage.finish();
            stage.assert_refused(FaultCode::GuardianLost);
        }
    }
}

/// A silent operator begins nothing; one who falls silent with a motion loses the arm.
#[test]
fn fault_32_an_operator_who_is_silent_loses_the_arm() {
    for via in INTERFACES {
        let mut stage = Stage::ready(via, "");
        stage.rig.operator_alive = false;
        stage.rig.run_for(1.0);
        stage.arm();
        stage.start_nod();
        stage.finish();
        stage.assert_refused(FaultCode::OperatorLost);
        let mut stage = Stage::ready(via, "");
        stage.rig.operator_alive = false;
        stage.begin();
        stage.finish();
        let cause = stage.assert_stop(braked(FaultCode::OperatorLost));
        assert!(cause.trajectory_s < 0.31, "{cause:?}");
        stage.rig.operator_alive = true;
        stage.assert_works_again();
    }
}

/// The time of the loop's tests.
struct HandClock(Rc<Cell<u64>>);

impl Clock for HandClock {
    fn now_ns(&self) -> u64 {
        self.0.get()
    }

    fn sleep_until(&mut self, deadline_ns: u64) {
        self.0.set(deadline_ns);
    }
}

/// What a run of the real loop does besides moving.
#[derive(Clone, Copy, PartialEq)]
enum Audience {
    /// Everything is taken from the rings at once.
    Attentive,
    /// Nobody takes anything: the rings are full before the motion begins.
    Stalled,
    /// Readers come and go with every cycle.
    Restless,
}

/// Commanded joints of every cycle of a throw in the real loop, and the records
/// it lost.
fn loop_before(audience: Audience) -> (Vec<JointVector>, u32) {
    const PERIOD_NS: u64 = 4_000_000;
    // Tests run side by side, each in a domain of its own.
    let thread = std::thread::current();
    let test = thread.name().unwrap().rsplit("::").next().unwrap();
    let domain = format!("{}_{}_{}", &test[..8], audience as u8, std::process::id());
    let bus = Bus::join(&domain).unwrap();
    let boards = ControllerBoards::create(&bus).unwrap();
    let mut operator = OperatorEnd::take(&bus).unwrap();
    let reader = StateReader::open(&bus).unwrap();
    let control = ControlState::new(Limits::default(), Thresholds::strict());
    let mut all = rings();
    let mut order = |command, link| {
        let message = CommandMsg { command, link };
        all.bridge.commands.push(message).unwrap();
    };
    let hold = ControlCommand::Engage { hold: START_POSE };
    order(hold, Some(Box::new(IdealArm::default())));
    let now_ns = Rc::new(Cell::new(1_000_000_000_000));
    let clock = HandClock(Rc::clone(&now_ns));
    let mut real = RtLoop::new(control, clock, boards, all.rt);
    let throw = super::stage::fast_throw(START_POSE);
    let (begin, end) = (4200, 4200 + (throw.duration_s() * 250.0) as u64 + 20);
    let (mut reported, mut dropped) = (Vec::new(), 0);
    for cycle in 0..end {
        now_ns.set(now_ns.get() + PERIOD_NS);
        operator.beat();
        let q = reader.get().q_c;
        let report = JointReport {
            version: PAYLOAD_VERSION,
            arm_state: 1,
            arm_mode: 1,
            stamp_ns: now_ns.get() - 1_000_000,
            arrival_ns: now_ns.get() - 500_000,
            q: if cycle < 2 { START_POSE } else { q },
            ..JointReport::default()
        };
        all.reports[0].push(report).unwrap();
        if cycle == begin {
            let motion = Box::new(Motion::Spline(throw));
            order(ControlCommand::Run { id: 1, motion }, None);
        }
        real.cycle(now_ns.get(), 0, now_ns.get());
        if audience == Audience::Restless && cycle >= begin {
            let other = Bus::join(&domain).unwrap();
            let seen = StateReader::open(&other).unwrap().get();
            assert_eq!(seen.cycle, cycle + 1);
        }
        if audience != Audience::Stalled {
            while let Ok(record) = all.bridge.records.pop() {
                dropped = record.dropped;
            }
            while all.bridge.inputs.pop().is_ok() {}
        }
        if cycle >= begin {
            reported.push(reader.get().q_c);
        }
    }
    if audience == Audience::Stalled {
        all.bridge.records.pop().unwrap();
        now_ns.set(now_ns.get() + PERIOD_NS);
        real.cycle(now_ns.get(), 0, now_ns.get());
        dropped = std::iter::from_fn(|| all.bridge.records.pop().ok())
            .last()
            .unwrap()
            .dropped;
    }
    (reported, dropped)
}

#[test]
fn fault_30_a_recorder_that_stalls_costs_records_and_no_setpoint() {
    let (attentive, none) = loop_before(Audience::Attentive);
    let (stalled, some) = loop_before(Audience::Stalled);
    assert!(attentive == stalled);
    let moved = *attentive.last().unwrap() - attentive[0];
    assert!(moved.max_abs() > 0.2);
    assert_eq!(none, 0);
    assert!(some > 200, "{some}");
}

#[test]
fn fault_31_readers_that_come_and_go_while_it_moves_change_nothing() {
    let (alone, _) = loop_before(Audience::Attentive);
    let (watched, _) = loop_before(Audience::Restless);
    assert!(alone == watched);
}
