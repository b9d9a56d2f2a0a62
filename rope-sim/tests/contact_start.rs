//! How ropes start: inside an obstacle never, curved ones at rest.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod scenes;

use nalgebra::{Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, LiveRope, MovingFrames, Obstacle, Precision, RopeExtras, Scene,
    SceneBody, SceneError, Shape, SimulateError, roll_out_in,
};
use scenes::{Still, options};
use shared_types::RopeParams;

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.01, 0.05, 0.005, 0.06, 0.06, 0.02, 0.8])
}

/// A curved rope, the heavier the farther out, that starts in equilibrium stays there.
#[test]
fn a_curved_rope_starts_at_rest() {
    let rope = rope();
    let still = Still {
        p_m: Vector3::zeros(),
        r: Rotation3::from_euler_angles(0.3, 0.9, 0.2),
    };
    let extras = RopeExtras {
        rest_curvature_per_m: [1.0, 2.0, 0.5],
        mass_slope: 0.7,
        ..RopeExtras::NONE
    };
    let candidate = Candidate::new(&rope, &still).with_extras(extras);
    let run = roll_out_in(
        &Scene::EMPTY,
        &[candidate],
        &options(Precision::F64, 1.0, 10.0),
    )
    .unwrap()
    .remove(0);
    for frame in 1..=10 {
        let drift = run.nodes.position(frame, 22) - run.nodes.position(0, 22);
        assert!(drift.norm() < 1e-6, "{frame}: {drift}");
    }
}

/// Who starts inside what is said, whichever candidate it is.
#[test]
fn starting_inside_an_obstacle_is_refused_by_name() {
    let rope = rope();
    let still = |x_m: f64| Still {
        p_m: Vector3::new(x_m, 0.0, 0.0),
        r: Rotation3::identity(),
    };
    let (outside, inside) = (still(0.0), still(1.0));
    let block = Shape::Box { half_m: [0.02; 3] };
    let scene = Scene::with(vec![
        Obstacle::floor(-1.0, 0.5),
        Obstacle::fixed(block, [1.0, 0.0, -0.3], 0.5),
    ]);
    let candidates = [&outside, &inside].map(|motion| Candidate::new(&rope, motion));
    let options = options(Precision::F32, 0.1, 10.0);
    let refused = roll_out_in(&scene, &candidates, &options).unwrap_err();
    let SimulateError::Scene(SceneError::StartsInside {
        candidate,
        body,
        link,
        depth_m,
    }) = refused
    else {
        panic!("{refused}");
    };
    assert_eq!((candidate, body), (1, SceneBody::Obstacle(1)));
    assert!((10..14).contains(&link));
    // Deeper than a touch, at most half the block and the rope's radius.
    assert!((1e-3..0.0251).contains(&depth_m), "{depth_m}");
    assert_eq!(refused.candidate(), Some(1));
    let attach = MovingFrames::attach_only(inside.at(0.0));
    assert!(matches!(
        LiveRope::new_in(&scene, &rope, RopeExtras::NONE, &attach, 5e-4),
        Err(SimulateError::Scene(SceneError::StartsInside { .. }))
    ));
    assert!(roll_out_in(&scene, &candidates[..1], &options).is_ok());
}
