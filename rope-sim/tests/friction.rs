//! Dry friction in bending and a swing at the start, against formulas and an integrator of
//! this test's own.
#![cfg(test)]
#![allow(missing_docs, reason = "a test")]

mod support;

use nalgebra::Vector3;
use rope_sim::{Candidate, Outcome, Precision, Rollout, Scene, SimOptions, Sway, roll_out};
use shared_types::{BendingFriction, RopeExtras, RopeParams};
use support::{options, pendulum, released, simulate, world};

const FRICTION: BendingFriction = BendingFriction {
    moment_max_nm: 0.05,
    slip_curvature_per_m: 0.2,
};

fn rubbing(rope: RopeParams, friction: BendingFriction) -> RopeParams {
    rope.with_extras(RopeExtras {
        friction: Some(friction),
        ..RopeExtras::NONE
    })
}

fn angles_rad(run: &Rollout) -> Vec<f64> {
    (0..run.nodes.frames())
        .map(|frame| {
            let hang = run.nodes.position(frame, 1) - run.nodes.position(frame, 0);
            (-hang.x).atan2(-hang.z)
        })
        .collect()
}

/// Angle of a pendulum with Dahl's friction every 0.05 s, by the classical Runge-Kutta
/// method in steps of 10 us.
fn reference_rad(rope: &RopeParams, friction: &BendingFriction, from_rad: f64) -> Vec<f64> {
    let (_, inertia, weight) = pendulum();
    let limit = friction.moment_max_nm;
    let sigma = limit / (friction.slip_curvature_per_m * rope.length_m);
    let rate = |[angle, w, z]: [f64; 3]| {
        let spring = rope.joint_stiffness_nm_per_rad * angle + rope.joint_damping_nms_per_rad * w;
        let alpha = (-weight * angle.sin() - spring - z) / inertia;
        [w, alpha, sigma * (w - w.abs() * z / limit)]
    };
    let along = |x: [f64; 3], k: [f64; 3], h: f64| [0, 1, 2].map(|i| x[i] + h * k[i]);
    let h = 1e-5;
    let mut x = [from_rad, 0.0, 0.0];
    let mut out = vec![from_rad];
    for step in 1..=50_000 {
        let k1 = rate(x);
        let k2 = rate(along(x, k1, 0.5 * h));
        let k3 = rate(along(x, k2, 0.5 * h));
        let k4 = rate(along(x, k3, h));
        x = [0, 1, 2].map(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
        if step % 5000 == 0 {
            out.push(x[0]);
        }
    }
    out
}

#[test]
fn a_pendulum_with_dry_friction_swings_as_dahls_equations_say() {
    let smooth = RopeParams {
        joint_damping_nms_per_rad: 0.002,
        joint_stiffness_nm_per_rad: 0.05,
        ..pendulum().0
    };
    let wanted = reference_rad(&smooth, &FRICTION, 0.9);
    for (precision, tolerance_rad) in [(Precision::F64, 2e-4), (Precision::F32, 5e-4)] {
        let options = released([0.0, 0.9, 0.0], options(precision, 0.5, 20.0));
        let run = simulate(&Scene::EMPTY, &rubbing(smooth, FRICTION), &world, &options);
        let found = angles_rad(&run);
        for (i, (a, b)) in found.iter().zip(&wanted).enumerate() {
            assert!((a - b).abs() < tolerance_rad, "{i}: {a} against {b} rad");
        }
    }
    // Friction is what makes the difference.
    let options = released([0.0, 0.9, 0.0], options(Precision::F64, 0.5, 20.0));
    let smooth = angles_rad(&simulate(&Scene::EMPTY, &smooth, &world, &options));
    let apart = smooth.iter().zip(&wanted).map(|(a, b)| (a - b).abs());
    assert!(apart.fold(0.0, f64::max) > 0.02);
}

/// Friction takes a swing's energy, leaves the rope hanging away from where it would without,
/// and half the step leads to the same motion.
#[test]
fn friction_calms_a_rope_and_holds_it_off_its_equilibrium() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.004, 0.1, 0.005, 0.05, 0.03, 0.02, 0.8]);
    let friction = BendingFriction {
        moment_max_nm: 0.004,
        slip_curvature_per_m: 0.5,
    };
    let (smooth, rope) = (rope, rubbing(rope, friction));
    let swing = Sway {
        angle_rad: [0.1, 0.35],
        ..Sway::NONE
    };
    let tips_of = |rope: &RopeParams, step_s: f64| {
        let options = SimOptions {
            step_s,
            ..options(Precision::F64, 12.0, 10.0)
        };
        let candidate = Candidate::new(rope, &world).with_sway(swing);
        let run = roll_out(&[candidate], &options).unwrap().remove(0);
        assert_eq!(run.outcome, Outcome::Clean);
        let tip = |frame: usize| run.nodes.position(frame, 22);
        (0..run.nodes.frames())
            .map(tip)
            .collect::<Vec<Vector3<f64>>>()
    };
    let (coarse, fine) = (tips_of(&rope, 2e-3), tips_of(&rope, 1e-3));
    let apart = coarse.iter().zip(&fine).map(|(a, b)| (a - b).norm());
    let apart = apart.fold(0.0, f64::max);
    assert!(apart < 1e-3, "{apart} m between 2 ms and 1 ms");
    let swing_m = |tips: &[Vector3<f64>]| {
        let x = || tips.iter().map(|tip| tip.x);
        let (least, most) = (x().fold(f64::MAX, f64::min), x().fold(f64::MIN, f64::max));
        (most - least, f64::midpoint(least, most))
    };
    let ([begin, _], [end, middle]) = (swing_m(&fine[..20]).into(), swing_m(&fine[100..]).into());
    let (smooth, _) = swing_m(&tips_of(&smooth, 1e-3)[100..]);
    assert!(
        end < 0.3 * begin && end < 0.5 * smooth,
        "{begin}, {end}, {smooth} m"
    );
    assert!(middle.abs() > 5e-4, "{middle} m off");
}

/// A pendulum whose only joint is three times as stiff as its others would be.
#[test]
fn a_clamp_is_a_stiffer_first_joint() {
    let soft = RopeParams {
        joint_damping_nms_per_rad: 0.004,
        joint_stiffness_nm_per_rad: 0.08,
        ..pendulum().0
    };
    for clamp_stiffness in [3.0, 0.4] {
        let clamped = soft.with_extras(RopeExtras {
            clamp_stiffness,
            friction: Some(FRICTION),
            ..RopeExtras::NONE
        });
        let friction = BendingFriction {
            moment_max_nm: clamp_stiffness * FRICTION.moment_max_nm,
            ..FRICTION
        };
        let stiff = rubbing(
            RopeParams {
                joint_damping_nms_per_rad: clamp_stiffness * soft.joint_damping_nms_per_rad,
                joint_stiffness_nm_per_rad: clamp_stiffness * soft.joint_stiffness_nm_per_rad,
                ..soft
            },
            friction,
        );
        let options = released([0.0, 0.9, 0.0], options(Precision::F64, 1.0, 20.0));
        let [a, b] = [clamped, stiff]
            .map(|rope| angles_rad(&simulate(&Scene::EMPTY, &rope, &world, &options)));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-9, "{a} against {b} rad");
        }
    }
}

/// A small swing of a pendulum: `angle cos(w t) + rate / w sin(w t)` in each plane.
#[test]
fn a_swing_goes_on_as_a_pendulum_does() {
    let (rope, inertia, weight) = pendulum();
    let sway = Sway {
        angle_rad: [0.004, -0.003],
        rate_rad_s: [0.01, 0.02],
    };
    let candidate = Candidate::new(&rope, &world).with_sway(sway);
    let run = roll_out(&[candidate], &options(Precision::F64, 2.0, 50.0)).unwrap();
    let w = (weight / inertia).sqrt();
    for frame in 0..run[0].nodes.frames() {
        let hang = run[0].nodes.position(frame, 1) - run[0].nodes.position(frame, 0);
        let (s, c) = (w * frame as f64 / 50.0).sin_cos();
        let [x, y] = [0, 1].map(|i| sway.angle_rad[i] * c + sway.rate_rad_s[i] / w * s);
        // Turned about x the rope hangs along +y, about y along -x.
        let wanted = [-y * rope.length_m, x * rope.length_m];
        for axis in 0..2 {
            let off = hang[axis] - wanted[axis];
            assert!(off.abs() < 5e-6, "frame {frame}, axis {axis}: {off} m");
        }
    }
}

#[test]
fn a_swing_and_a_straight_start_exclude_each_other() {
    let (rope, ..) = pendulum();
    let options = released([0.0, 0.2, 0.0], options(Precision::F64, 0.1, 10.0));
    let sway = Sway {
        angle_rad: [0.1, 0.0],
        ..Sway::NONE
    };
    let refused = roll_out(&[Candidate::new(&rope, &world).with_sway(sway)], &options);
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("swings at the start")
    );
}
