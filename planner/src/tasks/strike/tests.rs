use super::*;
use crate::ropes::random_rope;
use crate::trajopt::{Clearance, Dimensions};

fn request(target_m: [f64; 3]) -> StrikeRequest {
    StrikeRequest {
        rope: random_rope(11),
        target_m,
        limits: Limits::default(),
        options: StrikeOptions {
            population: 24,
            generations: 12,
            ..StrikeOptions::default()
        },
        config: StrikeConfig::default(),
    }
}

fn go_on(_: PlanProgress) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

#[test]
fn fitness_is_the_sum_of_its_named_terms() {
    let weights = StrikeWeights::default();
    let space = WaypointSpace {
        start: start_pose_for([0.9, 0.0, 0.2]),
        dimensions: Dimensions::Planar,
        times_s: [0.45, 0.8, 1.15],
    };
    let clearance = Clearance::default();
    let screen = Screen::new(space.clone(), Limits::default(), clearance).unwrap();
    let rest = space.decode(&space.resting()).unwrap();
    let outcome = ThrowOutcome {
        closest_m: 0.25,
        closest_s: 0.7,
        contacts: ContactCounts {
            rope_robot: 3,
            pole_robot: 2,
            base_region: 1,
        },
        finite: true,
    };
    let got = valued(&weights, &screen, &rest, &outcome).fitness;
    let want = 0.25 - 1.0 / 1.25 + 3.0 * 0.02 + 2.0 * 0.1 + 0.2;
    assert!((got - want).abs() < 1e-12);
    let mut x = space.resting();
    x[0] += 0.2;
    let moved = space.decode(&x).unwrap();
    assert!((joint_motion_rad(&moved) - 0.4).abs() < 1e-12);
    let lost = ThrowOutcome {
        finite: false,
        ..outcome
    };
    assert!(valued(&weights, &screen, &rest, &lost).fitness > 100.0);
}

#[test]
fn a_small_search_comes_close_and_keeps_every_limit() {
    let mut generations = 0;
    let r = request([0.95, 0.25, 0.1]);
    let plan = plan_strike(&r, &mut |p| {
        generations = p.generation;
        ControlFlow::Continue(())
    })
    .unwrap();
    assert!(plan.predicted_error_m < 0.05, "{}", plan.predicted_error_m);
    assert_eq!(generations, 12);
    assert!(plan.margins.iter().all(|m| m.left >= 0.0));
    assert_eq!(plan.trajectory.start(), start_pose_for(r.target_m));
    assert_eq!(
        plan.trajectory_sha256,
        trajectory_hash_hex(&plan.trajectory)
    );
}

#[test]
fn same_plan_for_one_and_two_threads() {
    let mut r = request([0.9, -0.2, 0.3]);
    r.options.generations = 4;
    r.options.threads = 1;
    let one = plan_strike(&r, &mut go_on).unwrap();
    r.options.threads = 2;
    assert_eq!(one, plan_strike(&r, &mut go_on).unwrap());
    r.options.seed += 1;
    assert_ne!(
        one.trajectory,
        plan_strike(&r, &mut go_on).unwrap().trajectory
    );
}

#[test]
fn impossible_requests_are_refused_before_any_simulation() {
    let mut called = false;
    let mut progress = |_: PlanProgress| {
        called = true;
        ControlFlow::Continue(())
    };
    let far = plan_strike(&request([1.8, 0.3, 0.4]), &mut progress);
    assert!(matches!(far, Err(PlanError::Unreachable { .. })));
    let mut r = request([0.9, 0.0, 0.2]);
    r.rope.length_m = f64::NAN;
    assert!(matches!(
        plan_strike(&r, &mut progress),
        Err(PlanError::Rope(_))
    ));
    let mut r = request([0.9, 0.0, 0.2]);
    r.options.step_s = 0.0;
    assert!(matches!(
        plan_strike(&r, &mut progress),
        Err(PlanError::Option {
            option: "step_s",
            ..
        })
    ));
    assert!(!called);
}

#[test]
fn a_search_can_be_broken_off() {
    let result = plan_strike(&request([0.9, 0.0, 0.2]), &mut |p| {
        if p.generation == 2 {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    assert!(matches!(
        result,
        Err(PlanError::Cancelled { generation: 2 })
    ));
}
