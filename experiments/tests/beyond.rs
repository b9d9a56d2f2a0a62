//! Ropes with physics beyond the nine parameters: found where a film shows it, and thrown
//! with it.
#![cfg(test)]

use planner::identify::{IdentifyOptions, identify};
use planner::observation::{Appearance, Observation, ObservedPoints};
use planner::plan::{PlanOptions, PlanRequest, Strike, ThrowConfig, ThrowGoal, plan};
use planner::ropes::{random_strike_target, trial_rope};
use planner::synthetic::{FilmNoise, FilmTiming, film, side_camera};
use planner::wiggle::{WiggleConfig, wiggling_arm};
use rope_sim::{Candidate, PlannedArm, Precision, SimOptions, Watch, roll_out};
use shared_types::{BendingFriction, RopeEstimate, RopeExtras, RopeParams};
use std::ops::ControlFlow;

fn identified(rope: &RopeParams, seed: u64) -> RopeEstimate {
    let motion = wiggling_arm(&WiggleConfig::default()).unwrap();
    let camera = side_camera();
    let noise = FilmNoise {
        clock_offset_s: 0.004,
        ..FilmNoise::white(0.3, seed)
    };
    let timing = FilmTiming::default();
    let filmed = film(rope, &motion, &camera, 25, &timing, &noise).unwrap();
    let observation = Observation {
        track: &filmed.track,
        points: ObservedPoints::ArcLength,
        camera: &camera,
        motion: &motion,
        appearance: Appearance::default(),
    };
    let options = IdentifyOptions {
        seed,
        ..IdentifyOptions::default()
    };
    identify(&observation, &options, None, &mut |_| {
        ControlFlow::Continue(())
    })
    .unwrap()
}

/// Where the tip of `rope` passes the target of a strike planned for `planned_for` (m).
fn miss_m(planned_for: &RopeParams, rope: &RopeParams, seed: u64) -> f64 {
    let goal = ThrowGoal::Strike(Strike {
        target_m: random_strike_target(seed),
        config: ThrowConfig::default(),
    });
    let request = PlanRequest::new(goal, planned_for, PlanOptions::default());
    let planned = plan(&request, &mut |_| ControlFlow::Continue(())).unwrap();
    let arm = PlannedArm::new(planned.trajectory, request.cell.pole);
    let horizon_s = planned.trajectory.duration_s() + 0.5;
    let options = SimOptions {
        watch: Watch::point(random_strike_target(seed)),
        ..SimOptions::new(2.5e-4, Precision::F64, horizon_s)
    };
    let thrown = roll_out(&[Candidate::new(rope, &arm)], &options).unwrap();
    thrown[0].watched.to_point.unwrap().distance_m
}

/// Without these the fit is 5 to 20 mm off in length, and so are its throws.
#[test]
fn friction_and_curvature_are_found_and_thrown_with() {
    for (index, direction_rad) in [(0_u64, 0.4_f64), (1, 2.5)] {
        let plain = trial_rope(41, index);
        let friction = BendingFriction {
            moment_max_nm: 0.4 * plain.bending_stiffness_nm2(),
            slip_curvature_per_m: 0.5,
        };
        let (sin, cos) = direction_rad.sin_cos();
        let rope = plain.with_extras(RopeExtras {
            rest_curvature_per_m: [0.4 * cos, 0.4 * sin, 0.0],
            friction: Some(friction),
            ..RopeExtras::NONE
        });
        let found = identified(&rope, index).params;
        let off_m = (found.length_m - rope.length_m).abs();
        assert!(off_m < 2.5e-3, "{found:?} against {rope:?}");
        let extras = found.extras.unwrap();
        let held = extras.friction.unwrap().moment_max_nm / found.bending_stiffness_nm2();
        assert!((held - 0.4).abs() < 0.08, "{extras:?}");
        for axis in 0..2 {
            let curvature = extras.rest_curvature_per_m[axis];
            let off = curvature - rope.beyond().rest_curvature_per_m[axis];
            assert!(off.abs() < 0.12, "{extras:?} against {rope:?}");
        }
        let miss_m = miss_m(&found, &rope, index);
        assert!(miss_m < 4e-3, "{miss_m} m off the target");
    }
}

#[test]
fn a_rope_that_is_the_model_keeps_its_plain_fit() {
    for index in 2..5 {
        let rope = trial_rope(41, index);
        let found = identified(&rope, index);
        assert_eq!(found.params.extras, None);
        let miss_m = miss_m(&found.params, &rope, index);
        assert!(miss_m < 2e-3, "{miss_m} m off the target");
    }
}
