//! Faults of the plan: 22 to 24.

use super::judge::braked;
use super::limits;
use super::stage::{INTERFACES, Stage, config, fast_throw};
use arm_model::limits::{LimitKind, LimitsSpec};
use arm_model::{JointTrajectory, JointVector, Limits, Pole};
use rt_controller::control::Motion;
use rt_controller::point_to_point::verify;
use shared_types::plan::trajectory_hash;
use shared_types::{CommandInterface, FaultCode};
use xarm_sim::{Fault, FaultKind, Trigger};

/// Half a degree and a little (rad).
const BESIDE_RAD: f64 = 0.0088;

#[test]
fn fault_22_a_plan_that_begins_half_a_degree_beside_the_arm_is_refused() {
    for via in INTERFACES {
        let mut stage = Stage::ready(via, "");
        let mut beside = stage.rig.commanded();
        beside[2] += BESIDE_RAD;
        stage.arm();
        stage.rig.start(Motion::Spline(fast_throw(beside)));
        stage.finish();
        stage.assert_refused(FaultCode::StartPoseMismatch);
    }
}

/// The plan fits what the controller commands, but the arm is elsewhere.
#[test]
fn fault_22_an_arm_that_stands_beside_what_it_was_told_begins_nothing() {
    for via in INTERFACES {
        for (by_rad, begins) in [(0.0095, false), (0.006, true)] {
            let mut stage = Stage::ready(via, "");
            stage.rig.inject(Fault {
                trigger: Trigger::At(0.0),
                duration_s: None,
                kind: FaultKind::EncoderJump { joint: 3, by_rad },
            });
            // At once, before the position loop of velocity mode works it off.
            stage.rig.run_cycles(2);
            stage.arm();
            stage.rig.start(Motion::Spline(stage.throw));
            stage.rig.run_cycles(6);
            if begins {
                let began = stage.on_path().next().is_some();
                assert!(began, "{:?}", stage.rig.log.events);
            } else {
                stage.assert_refused(FaultCode::StartPoseMismatch);
            }
        }
    }
}

/// What no trajectory can be made of, never gets as far as the controller.
#[test]
fn fault_23_a_plan_that_is_no_trajectory_is_refused_by_its_type() {
    let rest = JointVector::ZERO;
    let make = |times: &[f64], poses: &[JointVector]| JointTrajectory::new(times, poses);
    for bad in [f64::NAN, f64::INFINITY] {
        let mut pose = rest;
        pose[5] = bad;
        assert!(make(&[0.0, 1.0], &[rest, pose]).is_err());
        assert!(make(&[0.0, bad], &[rest, rest]).is_err());
    }
    for times in [[0.0, 0.5, 0.5], [0.0, 0.5, 0.4]] {
        assert!(make(&times, &[rest; 3]).is_err(), "{times:?}");
    }
    assert!(make(&[0.0, 1.0], &[rest; 3]).is_err());
    for joints in [6, 8] {
        let text = serde_json::to_string(&vec![0.0; joints]).unwrap();
        assert!(
            serde_json::from_str::<JointVector>(&text).is_err(),
            "{joints} joints"
        );
    }
    // One bit in one number, and the hash is another one.
    let mut other = rest;
    other[3] = f64::from_bits(1);
    let hash = |pose| trajectory_hash(&make(&[0.0, 1.0], &[rest, pose]).unwrap());
    assert_ne!(hash(rest), hash(other));
}

/// What the preflight of an upload refuses, the limiter alone would end, too.
#[test]
fn fault_23_a_plan_outside_the_limits_is_refused_and_would_be_braked() {
    // Joint, way (rad), time (s) and what it breaks.
    let cases = [
        (6, 3.0, 1.2, FaultCode::SetpointVelocity),
        (6, 0.9, 0.5, FaultCode::SetpointAcceleration),
        (5, 1.65, 1.2, FaultCode::SetpointPosition),
    ];
    for via in INTERFACES {
        for (joint, way_rad, time_s, fault) in cases {
            // By velocities an arm may overshoot the end of a range by its own jerk
            // and stop with C23; only the preflight keeps such a plan away.
            if via == CommandInterface::JointVelocity && fault == FaultCode::SetpointPosition {
                continue;
            }
            let mut stage = Stage::ready(via, "");
            let from = stage.rig.commanded();
            let mut to = from;
            to[joint] += way_rad;
            let plan = JointTrajectory::new(&[0.0, time_s], &[from, to]).unwrap();
            let limits = Limits::default();
            assert!(limits.worst_violation(&plan).is_some());
            assert!(verify(&Motion::Spline(plan), &limits).is_err());
            stage.arm();
            stage.rig.start(Motion::Spline(plan));
            stage.finish();
            let found = stage.rig.log.causes.first().map(|c| c.fault());
            // A range is not left: already from where no brake would hold it.
            let expected = if fault == FaultCode::SetpointPosition {
                FaultCode::SetpointUnstoppable
            } else {
                fault
            };
            assert_eq!(found, Some(expected), "{via:?}");
            stage.assert_stop(braked(expected));
            stage.assert_works_again();
        }
    }
}

/// A throw that the flange may do, but not the end of a pole.
#[test]
fn fault_24_a_plan_too_fast_for_the_configured_tool_is_refused_with_time_and_margin() {
    for via in INTERFACES {
        let mut config = config(via, "");
        let with_pole = Limits::try_from(LimitsSpec {
            tcp_offset_m: Pole::default().end_m().into(),
            ..config.limits.clone().into()
        })
        .unwrap();
        config.limits = with_pole.clone();
        let mut stage = Stage::of(config);
        assert!(Limits::default().worst_violation(&stage.throw).is_none());
        let margin = with_pole.worst_violation(&stage.throw).unwrap();
        assert_eq!((margin.kind, margin.joint), (LimitKind::TcpSpeed, 0));
        assert!(margin.value > margin.limit && margin.left < 0.0);
        assert!((0.0..stage.throw.duration_s()).contains(&margin.time_s));
        let said = margin.describe();
        assert!(said.contains("tool") && said.contains("m/s"), "{said}");
        // Past the preflight, the limiter ends it just before that moment.
        stage.arm();
        stage.rig.start(Motion::Spline(stage.throw));
        stage.finish();
        let cause = stage.rig.log.causes[0];
        assert_eq!(cause.fault(), FaultCode::SetpointTcpSpeed);
        assert!(cause.trajectory_s < margin.time_s);
        limits::assert_kept(&stage, limits::EVER, 0.0);
        stage.assert_stop(braked(FaultCode::SetpointTcpSpeed));
    }
}
