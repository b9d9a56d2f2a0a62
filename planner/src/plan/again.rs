//! A strike corrected by the miss of the one before.
//!
//! What the model leaves out lets the tip pass beside the target, and does so again in a throw
//! that hardly differs. So the last throw is changed as little as possible, until the simulated
//! tip passes as far on the other side: iterative learning control in which the simulator gives
//! the slopes. With each throw the aim moves by the miss, so what persists is taken out.

use super::config::STRETCH_MAX;
use super::planning::check;
use super::setup::{Count, Setup};
use super::{
    PlanError, PlanOptions, PlanRequest, PosteriorEnsemble, Strike, ThrowGoal, start_pose_for,
};
use crate::PlannerConfig;
use crate::arm_response::Following;
use arm_model::{Cell, JointTrajectory, JointVector, Limits, TrajectoryError};
use core::f64::consts::PI;
use nalgebra::Vector3;
use shared_types::plan::Aim;
use shared_types::{Plan, Task};

/// Longest miss that is taken for one of the same throw (m); beyond, the model does not hold.
const MISS_MAX_M: f64 = 0.15;
/// What a stereo camera's miss is taken to be off by, each axis (m, one standard deviation). The
/// distances of rendered throws are off by 1 to 2 mm in the median; more along the line of sight.
pub const MISS_STD_M: f64 = 2e-3;
/// What is left of a miss after its correction, each axis (one standard deviation): a throw that
/// differs misses differently. Tuned in another reality (`experiments full-pipeline`, odd seeds).
const LEFT_FRACTION: f64 = 0.15;
/// Rounds of polishing at most: a throw moves by centimetres, its slopes hold for less.
const ROUNDS: usize = 4;

/// Corrects the strike `last`, whose tip passed the target by `miss_m` (tip minus target at the
/// closest approach, m, base frame). The rope is the one that `last` was planned for; the
/// request's, and its ensemble, are not used. The plan is for the request's target, from where
/// `last` aimed.
///
/// # Errors
/// As [`plan`](super::plan); another task than a strike, a `last` of other joints or waypoints
/// than the request's, a miss that is none of this throw, or that `last` already corrected.
pub fn plan_again(request: &PlanRequest, last: &Plan, miss_m: [f64; 3]) -> Result<Plan, PlanError> {
    let (ThrowGoal::Strike(strike), Task::Strike) = (&request.goal, last.task) else {
        return refused("only strikes are corrected by their miss: plan a lob or a drape anew");
    };
    if let Err(swung) = last.require_at_rest() {
        return refused(swung.to_string());
    }
    if last.cell.is_some_and(|cell| cell != request.cell) {
        return refused("the last throw was planned for another cell: plan anew");
    }
    let response = request.following.as_ref().map(Following::source);
    if response != last.arm_response.as_deref() {
        let named = |source: Option<&str>| source.unwrap_or("none").to_owned();
        return refused(format!(
            "the last throw was planned for an arm with the response of `{}`, this one would be for `{}`: give the same one (--arm-response, or the controller's arm_response_file), or plan anew",
            named(last.arm_response.as_deref()),
            named(response)
        ));
    }
    let miss_length_m = Vector3::from(miss_m).norm();
    if miss_length_m.is_nan() || miss_length_m > MISS_MAX_M {
        return refused(format!(
            "a miss of {:.1} cm is too far to be corrected (at most {:.0} cm): identify the rope again",
            100.0 * miss_length_m,
            100.0 * MISS_MAX_M
        ));
    }
    if last.aim.is_some_and(|aim| aim.miss_m == Some(miss_m)) {
        return refused(
            "the last throw already corrected this miss: score the film of that throw, not of the one before (if it did miss by the same, give --miss to a tenth of a millimetre)",
        );
    }
    let (aimed_m, corrections) =
        (last.aim).map_or((last.target_m, 0), |a| (a.point_m, a.corrections));
    let aimed_m = Vector3::from(aimed_m);
    let moved = Vector3::from(strike.target_m) - Vector3::from(last.target_m);
    let correction = Vector3::from(miss_m) * gain(miss_length_m, corrections + 1);
    let aim = Strike {
        target_m: (aimed_m + moved - correction).into(),
        config: strike.config.clone(),
    };
    let other = || {
        PlanError::Again(
            "the last throw moves other joints, or by other waypoints and times, than the planner is configured for: give the same configuration, or plan anew".to_owned(),
        )
    };
    let times_s = last.trajectory.times_s();
    let stretched = stretched(times_s, &aim.config.waypoint_times_s).ok_or_else(other)?;
    let request = PlanRequest {
        rope: last.rope,
        options: PlanOptions {
            segment_stretch_max: stretched,
            ..request.options
        },
        // Whatever the rope is, it has shown where this throw leads.
        ensemble: PosteriorEnsemble {
            forecast: vec![last.rope; PosteriorEnsemble::FORECAST],
            discrepancy_m: MISS_STD_M.hypot(LEFT_FRACTION * miss_length_m),
            ..PosteriorEnsemble::default()
        },
        ..request.clone()
    };
    check(&aim, &request).map_err(of_aim)?;
    let setup = Setup::new(&aim, &request)?;
    let turned = start_pose_for(aim.target_m)[0] - start_pose_for(aimed_m.into())[0];
    if turned.abs() > PI {
        return refused(
            "the correction leads past the bearing opposite to the arm's front, a full turn of joint 1 away: plan anew",
        );
    }
    let throw = turned_by(&last.trajectory, turned)?;
    let mut x = setup.space.encode(&throw).ok_or_else(other)?;
    let mut count = Count::default();
    for _ in 0..ROUNDS {
        let before = x.clone();
        let polished = setup.polish(vec![x], &mut count)?;
        x = polished.into_iter().next().unwrap_or_default();
        if x == before {
            break;
        }
    }
    let trajectory = setup.space.decode(&x)?;
    let chosen = setup.finalists(vec![(x, trajectory)], &mut count)?;
    let chosen = chosen.into_iter().next();
    let Some(chosen) = chosen else {
        return refused("the corrected throw lets the arm or its pole collide: plan anew");
    };
    Ok(Plan {
        target_m: strike.target_m,
        aim: Some(Aim {
            point_m: aim.target_m,
            corrections: corrections + 1,
            miss_m: Some(miss_m),
        }),
        unconfirmed: last.unconfirmed.clone(),
        ..setup.finish(chosen, &mut count)?
    })
}

impl PlanRequest {
    /// What [`plan_again`] is asked for where `last` is corrected in a cell, with these values of
    /// the planner.
    #[must_use]
    pub fn to_correct(
        last: &Plan,
        cell: Cell,
        (limits, config): (Limits, &PlannerConfig),
        following: Option<Following>,
    ) -> Self {
        Self {
            goal: config.goal(last.task, last.target_m),
            rope: last.rope,
            cell,
            options: PlanOptions {
                seed: last.seed,
                ..config.search
            },
            ensemble: PosteriorEnsemble::default(),
            following,
            limits,
            before: None,
        }
    }
}

/// One line for people: what `last` missed by, how the aim of `corrected` moves, and whether
/// that is worth a throw.
#[must_use]
pub fn correction(last: &Plan, corrected: &Plan, miss_m: [f64; 3]) -> String {
    let mm = |v: Vector3<f64>| {
        let [x, y, z] = (1e3 * v).into();
        format!("({x:+.1}, {y:+.1}, {z:+.1}) mm")
    };
    let aim = |plan: &Plan| Vector3::from(plan.aim.map_or(plan.target_m, |aim| aim.point_m));
    let miss = Vector3::from(miss_m);
    let little = if miss.norm() < 2.0 * MISS_STD_M {
        "; a camera is off by about as much, so this brings little"
    } else {
        ""
    };
    format!(
        "correction {}: the tip passed {} from the target, the aim moves by {}{little}",
        corrected.aim.map_or(1, |aim| aim.corrections),
        mm(miss),
        mm(aim(corrected) - aim(last))
    )
}

fn refused(why: impl Into<String>) -> Result<Plan, PlanError> {
    Err(PlanError::Again(why.into()))
}

/// What is wrong with the aim is not about the target that the user named.
fn of_aim(why: PlanError) -> PlanError {
    match why {
        PlanError::Target(_) | PlanError::Unreachable { .. } => PlanError::Again(format!(
            "the corrected throw aims beside its target, where none can: {why}"
        )),
        other => other,
    }
}

/// How much of a miss the correction with this number, from 1, takes out. All of one that is
/// large beside what a camera is off by; of smaller ones the mean of all misses so far, in which
/// the camera's errors average out.
fn gain(miss_m: f64, correction: u32) -> f64 {
    let noise = 2.0 * (MISS_STD_M / miss_m.max(1e-9)).powi(2);
    (1.0 - noise).max(1.0 / f64::from(correction))
}

/// How much the segments of a throw differ from those configured, as a factor; 1 for the same,
/// none for as many others, or where it is more than a search allows.
fn stretched(times_s: &[f64], configured_s: &[f64]) -> Option<f64> {
    let spans = |times: &[f64]| times.windows(2).map(|t| t[1] - t[0]).collect::<Vec<_>>();
    let (is, was) = (spans(times_s), spans(&[&[0.0], configured_s].concat()));
    let factors = is
        .iter()
        .zip(&was)
        .map(|(is, was)| (is / was).max(was / is));
    let factor = factors.fold(1.0, f64::max);
    let factor = if factor < 1.0 + 1e-9 { 1.0 } else { factor };
    let is_alike = is.len() == was.len() && factor < STRETCH_MAX + 1e-9;
    is_alike.then_some(factor.min(STRETCH_MAX))
}

/// The same motion with joint 1 elsewhere by `angle_rad` all along.
fn turned_by(
    trajectory: &JointTrajectory,
    angle_rad: f64,
) -> Result<JointTrajectory, TrajectoryError> {
    let turned = |q: &JointVector| {
        let mut q = *q;
        q[0] += angle_rad;
        q
    };
    let knots: Vec<JointVector> = trajectory.waypoints().iter().map(turned).collect();
    JointTrajectory::new(trajectory.times_s(), &knots)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::tests::request;
    use crate::plan::{ThrowSimulator, plan, simulator_for};
    use rope_sim::{Candidate, FrameTimes, PlannedArm, roll_out};
    use shared_types::RopeParams;
    use std::ops::ControlFlow;

    fn planned(request: &PlanRequest) -> Plan {
        plan(request, &mut |_| ControlFlow::Continue(())).unwrap()
    }

    /// How far another rope's tip passes the target in a throw (m).
    fn miss_m(request: &PlanRequest, rope: &RopeParams, thrown: &Plan) -> Vector3<f64> {
        let task = request.goal.task();
        let simulator = simulator_for(task, rope, &request.cell, &request.options);
        let simulator: ThrowSimulator = simulator.exact();
        let arm = PlannedArm::new(thrown.trajectory, request.cell.pole);
        let options = simulator.options(thrown.trajectory.duration_s(), FrameTimes::NONE);
        let rollouts = roll_out(&[Candidate::new(rope, &arm)], &options).unwrap();
        let closest = rollouts[0].watched.to_point.unwrap();
        Vector3::from(closest.tip_m) - Vector3::from(task.target_m())
    }

    #[test]
    fn large_misses_are_taken_out_whole_and_small_ones_on_average() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        near(gain(0.02, 1), 1.0);
        near(gain(0.02, 5), 0.98);
        near(gain(0.002, 2), 0.5);
        near(gain(0.0, 3), 1.0 / 3.0);
    }

    #[test]
    fn a_throw_with_times_of_its_own_keeps_them() {
        let mut request = request([0.95, 0.25, 0.1]);
        let plain = request.clone();
        request.options.segment_stretch_max = 1.3;
        let thrown = planned(&request);
        let again = plan_again(&plain, &thrown, [0.01, 0.0, -0.005]).unwrap();
        let pairs = again
            .trajectory
            .times_s()
            .iter()
            .zip(thrown.trajectory.times_s());
        for (again_s, thrown_s) in pairs {
            assert!((again_s - thrown_s).abs() < 1e-12);
        }
        assert!(again.predicted_error_m < 1e-3, "{again:?}");
    }

    /// A rope 8 mm longer and stiffer than the one planned for is struck at the third throw.
    #[test]
    fn what_persists_of_a_miss_is_taken_out() {
        for target_m in [[0.95, 0.25, 0.1], [0.9, -0.3, 0.4]] {
            let request = request(target_m);
            let truth = RopeParams {
                length_m: request.rope.length_m + 0.008,
                joint_stiffness_nm_per_rad: 1.3 * request.rope.joint_stiffness_nm_per_rad,
                ..request.rope
            };
            let mut thrown = planned(&request);
            let mut misses_m = Vec::new();
            for _ in 0..3 {
                let miss = miss_m(&request, &truth, &thrown);
                misses_m.push(miss.norm());
                thrown = plan_again(&request, &thrown, miss.into()).unwrap();
                assert_eq!(thrown.target_m, target_m);
                assert!(request.limits.worst_violation(&thrown.trajectory).is_none());
                assert!(thrown.predicted_error_m < 1e-3, "{thrown:?}");
                assert!(
                    thrown.forecast.unwrap().interval_90_m[1] < 0.01,
                    "{thrown:?}"
                );
            }
            let [first, second, third] = misses_m[..] else {
                panic!()
            };
            assert!(first > 4e-3, "{misses_m:?}");
            assert!(second < 0.4 * first && third < 1.5e-3, "{misses_m:?}");
        }
    }

    #[test]
    fn what_cannot_be_corrected_is_refused_with_the_reason() {
        let strike = request([0.95, 0.25, 0.1]);
        let thrown = planned(&strike);
        let refused = |request: &PlanRequest, miss_m| {
            let error = plan_again(request, &thrown, miss_m).unwrap_err();
            assert!(error.is_input());
            error.to_string()
        };
        assert!(refused(&strike, [0.2, 0.0, 0.0]).contains("20.0 cm is too far"));
        assert!(refused(&strike, [f64::NAN, 0.0, 0.0]).contains("too far"));
        let miss_m = [0.01, 0.0, -0.005];
        let corrected = plan_again(&strike, &thrown, miss_m).unwrap();
        let error = plan_again(&strike, &corrected, miss_m).unwrap_err();
        assert!(
            error.to_string().contains("already corrected this miss"),
            "{error}"
        );
        let mut lob = strike.clone();
        lob.goal = PlannerConfig::default().goal(Task::Lob, thrown.target_m);
        assert!(refused(&lob, [0.01, 0.0, 0.0]).contains("only strikes"));
        let mut elsewhere = strike.clone();
        elsewhere.cell.floor_z_m -= 0.1;
        assert!(refused(&elsewhere, [0.01, 0.0, 0.0]).contains("another cell"));
        let lagging = Plan {
            arm_response: Some("arm 1".to_owned()),
            ..thrown.clone()
        };
        let error = plan_again(&strike, &lagging, [0.01, 0.0, 0.0]).unwrap_err();
        assert!(error.to_string().contains("response of `arm 1`"), "{error}");
        let (start, end) = (thrown.trajectory.start(), thrown.trajectory.end());
        let other = Plan {
            trajectory: JointTrajectory::new(&[0.0, 1.0], &[start, end]).unwrap(),
            ..thrown.clone()
        };
        let error = plan_again(&strike, &other, [0.01, 0.0, 0.0]).unwrap_err();
        assert!(error.to_string().contains("other waypoints"), "{error}");
    }
}
