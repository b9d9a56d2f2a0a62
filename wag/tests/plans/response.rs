//! Throws through an arm whose joints lag by 10 to 40 ms, each by another time: planned
//! as if it did not, they miss; planned through its response, they meet their targets
//! again. `WAG_LONG_TESTS=1` makes 24 throws of the full search instead of 3 small ones.

use super::{long_tests, run};
use arm_model::response::{Estimate, JointResponse, TrackingLag};
use arm_model::{ArmResponse, JOINTS, JointTrajectory, Limits, Pole};
use hil_tests::virtual_rig::VirtualRig;
use planner::arm_response::Following;
use planner::plan::{PlanOptions, PlanRequest, Strike, ThrowConfig, ThrowGoal};
use planner::ropes::{random_rope, random_strike_target};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rope_sim::{Candidate, MeasuredArm, Precision, SimOptions, Watch, roll_out};
use rt_controller::control::Thresholds;
use shared_types::RopeParams;
use std::ops::ControlFlow;
use xarm_sim::{ArmConfig, JointLag};

/// Joints that are late by 10 to 40 ms in slow motion.
fn late_joints(rng: &mut ChaCha8Rng) -> [JointLag; JOINTS] {
    core::array::from_fn(|_| {
        let late_s: f64 = rng.random_range(0.010..0.040);
        let dead_time_s = late_s * rng.random_range(0.3..0.6);
        let damping_ratio = rng.random_range(0.7..1.0);
        JointLag {
            dead_time_s,
            natural_frequency_rad_s: 2.0 * damping_ratio / (late_s - dead_time_s),
            damping_ratio,
        }
    })
}

/// What a measurement makes of them: off by up to 0.5 ms and 1 %.
fn measured(joints: &[JointLag; JOINTS], rng: &mut ChaCha8Rng) -> ArmResponse {
    let known = |value: f64| Estimate {
        value,
        interval: [value, value],
    };
    ArmResponse {
        version: "0".to_owned(),
        source: "a test".to_owned(),
        command_to_target_s: None,
        excitation: None,
        joints: joints.map(|lag| {
            let mut about = || rng.random_range(0.99..1.01);
            let hz = lag.natural_frequency_rad_s / core::f64::consts::TAU;
            JointResponse::Excited(TrackingLag {
                natural_frequency_hz: known(hz * about()),
                damping_ratio: known(lag.damping_ratio * about()),
                dead_time_s: known(lag.dead_time_s + rng.random_range(-5e-4..5e-4)),
                residual_rad: 1e-5,
                samples: 1000,
            })
        }),
    }
}

/// The rope swings on where the arm has come to rest (s).
const SWINGS_ON_S: f64 = 0.6;

/// Tip and target at their closest on what the arm really did (m).
fn thrown_m(rig: &VirtualRig, rope: &RopeParams, target_m: [f64; 3]) -> f64 {
    assert!(rig.log.causes.is_empty(), "{:?}", rig.log.causes);
    let mut records = rig.log.records.iter();
    let first = records.find(|r| r.trajectory_s >= 0.0).unwrap();
    let truth = rig.log.truth.iter().filter(|s| s.at.0 >= first.deadline_ns);
    let (times_s, q): (Vec<f64>, Vec<_>) = truth
        .map(|s| ((s.at.0 - first.deadline_ns) as f64 * 1e-9, s.state.q))
        .unzip();
    let arm = MeasuredArm::new(&times_s, &q, Pole::default()).unwrap();
    let end_s = times_s[times_s.len() - 1];
    let options = SimOptions {
        watch: Watch::point(target_m),
        ..SimOptions::new(2.5e-4, Precision::F64, end_s + SWINGS_ON_S)
    };
    let rollouts = roll_out(&[Candidate::new(rope, &arm)], &options).unwrap();
    rollouts[0].watched.to_point.unwrap().distance_m
}

#[test]
fn throws_planned_through_the_response_meet_their_targets() {
    let throws = if long_tests() { 24 } else { 3 };
    let [mut unaware, mut aware, mut without] = [0.0; 3];
    for seed in 7100..7100 + throws {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (rope, target_m) = (random_rope(seed), random_strike_target(seed));
        let joints = late_joints(&mut rng);
        let response = measured(&joints, &mut rng);
        let limits = Limits::default();
        let plan = |following: Option<Following>| -> JointTrajectory {
            let small = !long_tests();
            let options = PlanOptions {
                seed,
                library_candidates: 0,
                population: if small { 24 } else { 60 },
                generations: small.then_some(12),
                searches: if small { 1 } else { 3 },
                ..PlanOptions::default()
            };
            let goal = ThrowGoal::Strike(Strike {
                target_m,
                config: ThrowConfig::default(),
            });
            let request = PlanRequest {
                following,
                ..PlanRequest::new(goal, &rope, options)
            };
            let planned = planner::plan(&request, &mut |_| ControlFlow::Continue(()));
            planned.unwrap().trajectory
        };
        let thrown = |plan: &JointTrajectory, joint_lags| {
            let arm = ArmConfig {
                joint_lags: Some(joint_lags),
                ..ArmConfig::default()
            };
            let rig = run(plan, &limits, Thresholds::strict().into(), arm);
            thrown_m(&rig, &rope, target_m)
        };
        let prompt = [JointLag {
            dead_time_s: 0.0,
            natural_frequency_rad_s: 1000.0,
            damping_ratio: 1.0,
        }; JOINTS];
        let plain = plan(None);
        let errors = [
            thrown(&plain, prompt),
            thrown(&plain, joints),
            thrown(&plan(Some(Following::new(&response, &limits))), joints),
        ];
        println!(
            "{seed}: prompt arm, late arm, planned for it (mm): {:.2?}",
            errors.map(|e| 1e3 * e)
        );
        without += errors[0];
        unaware += errors[1];
        aware += errors[2];
    }
    let removed = (unaware - aware) / (unaware - without);
    println!("{:.1} % of the extra error removed", 100.0 * removed);
    assert!(
        unaware > 2.0 * without,
        "the lag costs nothing: {unaware} {without}"
    );
    assert!(removed > 0.6, "{removed}");
}
