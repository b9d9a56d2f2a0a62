//! Behaviour that follows from mechanics alone.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use nalgebra::{Rotation3, Vector3};
use rope_sim::{AttachMotion, FrameTimes, Precision, Rollout, Scene, SimOptions};
use shared_types::RopeParams;
use support::{
    G_M_S2, assert_derivatives, options, pendulum, released, simulate, still, throw, tips, world,
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

/// The motion of all links about a fixed point conserves energy when nothing damps.
#[test]
fn undamped_energy_is_kept() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.0, 0.1, 0.008, 0.06, 0.06, 0.03, 1.2]);
    let rate_hz = 4000.0;
    // Two lever arms out of one plane: turned about an oblique axis, swinging.
    let options = SimOptions {
        step_s: 1.0 / rate_hz / 4.0,
        ..released([0.05, 0.1, 0.0], options(Precision::F64, 0.6, rate_hz))
    };
    let rollout = simulate(&Scene::EMPTY, &rope, &world, &options);
    let energy = |frame: usize| energy_j(&rope, &rollout, frame, rate_hz);
    let drop_m = rollout.nodes.position(0, 22).z + rope.length_m;
    let (start, scale) = (energy(1), rope.lead_mass_kg * G_M_S2 * drop_m);
    for frame in (1..2399).step_by(37) {
        let drift = (energy(frame) - start) / scale;
        assert!(drift.abs() < 5e-3, "frame {frame}: {drift}");
    }
}

/// Kinetic, gravity and spring energy from positions alone (velocities by central
/// differences); the spin of links about their own axes is neglected.
fn energy_j(rope: &RopeParams, rollout: &Rollout, frame: usize, rate_hz: f64) -> f64 {
    let n = rope.links as usize;
    let node = |frame: usize, i: usize| rollout.nodes.position(frame, i);
    let velocity = |i: usize| (node(frame + 1, i) - node(frame - 1, i)) * (0.5 * rate_hz);
    let s = rope.link_length_m();
    let mut sum = 0.0;
    let mut above = -Vector3::z();
    for i in 0..n {
        let direction = (node(frame, i + 1) - node(frame, i)) / s;
        let centre_velocity = (velocity(i) + velocity(i + 1)) / 2.0;
        let turning = (velocity(i + 1) - velocity(i)) / s;
        let inertia = rope.link_inertia_kg_m2()
            + if i + 1 == n {
                rope.lead_inertia_kg_m2()
            } else {
                0.0
            };
        let height = (node(frame, i).z + node(frame, i + 1).z) / 2.0;
        let angle = direction.cross(&above).norm().atan2(direction.dot(&above));
        sum += 0.5 * rope.link_mass_kg() * centre_velocity.norm_squared()
            + 0.5 * inertia * turning.norm_squared()
            + rope.link_mass_kg() * G_M_S2 * height
            + 0.5 * rope.joint_stiffness_nm_per_rad * angle * angle;
        above = direction;
    }
    sum + 0.5 * rope.lead_mass_kg * velocity(n).norm_squared()
        + rope.lead_mass_kg * G_M_S2 * node(frame, n).z
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
