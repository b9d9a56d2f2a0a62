//! Behaviour that follows from mechanics alone.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use nalgebra::{Rotation3, Vector3};
use rope_sim::{AttachMotion, FrameTimes, Precision, Scene, SimOptions};
use shared_types::RopeParams;
use support::{
    assert_derivatives, options, pendulum, released, simulate, still, throw, tips, world,
};

/// One rigid link is a pendulum; its period at any amplitude is an arithmetic-geometric
/// mean.
#[test]
fn one_link_swings_with_the_period_of_a_pendulum() {
    let (rope, inertia, moment) = pendulum();
    let (s, amplitude) = (rope.length_m, 1.2_f64);
    let (mut a, mut b) = (1.0, (amplitude / 2.0).cos());
    for _ in 0..6 {
        (a, b) = ((a + b) / 2.0, (a * b).sqrt());
    }
    let slow = core::f64::consts::TAU * (inertia / moment).sqrt();
    let period_s = slow / a;
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: period_s / 4.0,
            count: 5,
        },
        ..SimOptions::new(2.5e-4, Precision::F64, period_s)
    };
    let options = released([0.0, amplitude, 0.0], options);
    let rollout = simulate(&Scene::EMPTY, &rope, &world, &options);
    // A quarter of the way it hangs straight down, after a whole period it is back.
    let down = rollout.nodes.position(1, 1);
    assert!(down.x.abs() < 1e-5 * s, "{down}");
    let back = rollout.nodes.position(4, 1) - rollout.nodes.position(0, 1);
    assert!(back.norm() < 1e-5 * s, "{back}");
    let fastest = (2.0 * moment * (1.0 - amplitude.cos()) / inertia).sqrt() * s;
    assert!((rollout.peak_tip_speed_m_s / fastest - 1.0).abs() < 1e-4);
}

#[test]
fn equilibrium_stays_where_it_is_and_links_keep_their_length() {
    let rope = RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0]);
    let tilted = still(
        Vector3::zeros(),
        Rotation3::from_euler_angles(0.5, -0.8, 0.3),
    );
    for (precision, bound_m) in [(Precision::F64, 1e-9), (Precision::F32, 2e-5)] {
        let options = SimOptions {
            step_s: 2.5e-4,
            ..options(precision, 2.0, 10.0)
        };
        let rollout = simulate(&Scene::EMPTY, &rope, &tilted, &options);
        for frame in 0..rollout.nodes.frames() {
            for i in 0..=23 {
                let moved = rollout.nodes.position(frame, i) - rollout.nodes.position(0, i);
                assert!(
                    moved.norm() < bound_m,
                    "{precision:?} frame {frame} node {i}: {moved}"
                );
            }
            let link = rollout.nodes.position(frame, 9) - rollout.nodes.position(frame, 8);
            assert!((link.norm() - rope.link_length_m()).abs() < 1e-6);
        }
    }
}

#[test]
fn acceleration_jumps_do_not_cost_the_order() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.02, 0.3, 0.008, 0.06, 0.06, 0.03, 0.8]);
    let run = |step_s| {
        let options = SimOptions {
            step_s,
            ..options(Precision::F64, 0.9, 100.0)
        };
        tips(&simulate(&Scene::EMPTY, &rope, &throw(0.0), &options))
    };
    let truth = run(3.125e-5);
    let error = |step_s| {
        let pairs = run(step_s).into_iter().zip(&truth);
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(1e-3), error(2.5e-4));
    assert!(coarse < 5e-4, "{coarse} m at 1 ms");
    assert!(
        (coarse / fine).log2() / 2.0 > 1.7,
        "{coarse} m at 1 ms, {fine} m at 0.25 ms"
    );
}

/// Only ratios of stiffness, damping and masses act on the motion.
#[test]
fn scaling_all_forces_and_masses_changes_nothing() {
    let rope = RopeParams::from_array([20.0, 0.55, 0.006, 0.15, 0.0055, 0.03, 0.03, 0.02, 1.0]);
    let scaled = RopeParams {
        joint_damping_nms_per_rad: 2.0 * rope.joint_damping_nms_per_rad,
        joint_stiffness_nm_per_rad: 2.0 * rope.joint_stiffness_nm_per_rad,
        mass_per_length_kg_per_m: 2.0 * rope.mass_per_length_kg_per_m,
        lead_mass_kg: 2.0 * rope.lead_mass_kg,
        ..rope
    };
    let options = released([0.4, 0.7, 0.3], options(Precision::F64, 0.5, 20.0));
    let [a, b] = [rope, scaled].map(|rope| simulate(&Scene::EMPTY, &rope, &world, &options));
    for (x, y) in a.nodes.to_f64().into_iter().zip(b.nodes.to_f64()) {
        assert!((x - y).abs() < 1e-9);
    }
}

#[test]
fn a_planned_arms_derivatives_are_those_of_its_pose_and_it_holds_outside() {
    let arm = throw(0.0);
    assert_derivatives(&arm, [0.05, 0.13, 0.3, 0.4]);
    assert_eq!(arm.at(-1.0).v_m_s.norm(), 0.0);
    let end_s = arm.duration_s();
    assert_eq!(arm.at(9.0).p_m, arm.at(end_s + 1e-9).p_m);
}
