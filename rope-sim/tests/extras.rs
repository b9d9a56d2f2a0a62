//! Air drag, rest curvature and the domino against formulas.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

mod support;

use arm_model::kinematics::FrameMotion;
use nalgebra::{Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, Domino, Outcome, Precision, Rollout, Scene, SimOptions, roll_out,
};
use shared_types::{AirDrag, RopeExtras, RopeParams};
use support::{AIR, G_M_S2, options, released, simulate, still, world};

/// One rigid link with a lead: a pendulum.
fn pendulum() -> RopeParams {
    RopeParams {
        links: 1,
        length_m: 1.0,
        joint_damping_nms_per_rad: 0.0,
        joint_stiffness_nm_per_rad: 0.0,
        radius_m: 0.005,
        mass_per_length_kg_per_m: 1e-4,
        lead_mass_kg: 0.1,
        lead_radius_m: 0.01,
        link_extra_scale: 0.05,
        extras: None,
    }
}

/// Constant velocity and acceleration.
fn uniform(velocity_m_s: Vector3<f64>, acceleration_m_s2: Vector3<f64>) -> impl AttachMotion {
    move |t_s: f64| {
        let v = velocity_m_s + acceleration_m_s2 * t_s;
        FrameMotion {
            p_m: (velocity_m_s + v) * (0.5 * t_s),
            v_m_s: v,
            a_m_s2: acceleration_m_s2,
            ..FrameMotion::world()
        }
    }
}

/// `rope` with `extras` on a motion.
fn run(
    rope: &RopeParams,
    extras: RopeExtras,
    motion: &dyn AttachMotion,
    options: &SimOptions,
) -> Rollout {
    let rope = rope.with_extras(extras);
    roll_out(&[Candidate::new(&rope, motion)], options)
        .unwrap()
        .remove(0)
}

/// Towed at a constant speed a pendulum trails at the angle where drag and weight
/// balance about its joint.
#[test]
fn a_towed_pendulum_trails_at_the_angle_of_balance() {
    let rope = RopeParams {
        joint_damping_nms_per_rad: 0.15,
        lead_radius_m: 0.03,
        ..pendulum()
    };
    let v = 14.0;
    let tow = uniform(Vector3::x() * v, Vector3::zeros());
    let extras = RopeExtras {
        air_drag: Some(AIR),
        ..RopeExtras::NONE
    };
    let moment = |angle: f64| {
        let across = v * angle.cos();
        let half = 0.5 * AIR.air_density_kg_m3;
        let link = half * 2.0 * rope.radius_m * AIR.normal_coefficient * across * across * 0.5;
        let lead_m2 = core::f64::consts::PI * rope.lead_radius_m.powi(2);
        let lead = half * lead_m2 * AIR.lead_coefficient * v * across;
        let mass = rope.lead_mass_kg + 0.5 * rope.mass_per_length_kg_per_m;
        link + lead - mass * G_M_S2 * angle.sin()
    };
    let (mut low, mut high) = (0.0, 1.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if moment(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    for precision in [Precision::F64, Precision::F32] {
        let run = run(&rope, extras, &tow, &options(precision, 12.0, 1.0));
        let hang = run.nodes.position(12, 1) - run.nodes.position(12, 0);
        let angle = (-hang.x).atan2(-hang.z);
        assert!((angle - low).abs() < 2e-3, "{angle} against {low}");
        assert!(low > 0.2);
    }
}

/// A swing in air only ever gets smaller.
#[test]
fn drag_takes_energy_away() {
    let rope = pendulum();
    let heavy_air = AirDrag {
        air_density_kg_m3: 50.0,
        ..AIR
    };
    let extras = RopeExtras {
        air_drag: Some(heavy_air),
        ..RopeExtras::NONE
    };
    let options = released([0.0, 1.2, 0.0], options(Precision::F64, 10.0, 200.0));
    let run = run(&rope, extras, &world, &options);
    let height = |f: usize| run.nodes.position(f, 1).z;
    let peaks: Vec<f64> = (1..run.nodes.frames() - 1)
        .filter(|f| height(*f) > height(f - 1) && height(*f) >= height(f + 1))
        .map(height)
        .collect();
    assert!(peaks.len() > 5);
    assert!(peaks[0] < height(0));
    assert!(peaks.windows(2).all(|w| w[1] < w[0]), "{peaks:?}");
}

/// In free fall a curved rope comes to rest as the arc of its curvature.
#[test]
fn a_curved_rope_rests_as_an_arc() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.4, 1.0, 0.005, 0.02, 0.005, 0.03, 0.8]);
    let fall = uniform(Vector3::zeros(), Vector3::z() * -G_M_S2);
    let curvature = [0.8, 2.5, 0.0];
    let extras = RopeExtras {
        rest_curvature_per_m: curvature,
        ..RopeExtras::NONE
    };
    let options = released([0.0; 3], options(Precision::F64, 8.0, 1.0));
    let run = run(&rope, extras, &fall, &options);
    assert_eq!(run.outcome, Outcome::Clean);
    let s = rope.link_length_m();
    let mut want = run.nodes.position(8, 0);
    for node in 1..=22 {
        let turn = Rotation3::from_scaled_axis(Vector3::from(curvature) * (s * f64::from(node)));
        want += turn * Vector3::z() * -s;
        let got = run.nodes.position(8, usize::try_from(node).unwrap());
        assert!(
            (got - want).norm() < 1e-4,
            "node {node}: {got} against {want}"
        );
    }
}

/// A curved rope, the heavier the farther out, that starts in equilibrium stays there.
#[test]
fn a_curved_rope_starts_at_rest() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.01, 0.05, 0.005, 0.06, 0.06, 0.02, 0.8]);
    let tilted = still(
        Vector3::zeros(),
        Rotation3::from_euler_angles(0.3, 0.9, 0.2),
    );
    let extras = RopeExtras {
        rest_curvature_per_m: [1.0, 2.0, 0.5],
        mass_slope: 0.7,
        ..RopeExtras::NONE
    };
    let run = run(&rope, extras, &tilted, &options(Precision::F64, 1.0, 10.0));
    for frame in 1..=10 {
        let drift = run.nodes.position(frame, 22) - run.nodes.position(0, 22);
        assert!(drift.norm() < 1e-6, "{frame}: {drift}");
    }
}

/// A pendulum strikes a tall block near its top and stays at it. With the impulse `J =
/// m v` at height h the two turn on with `(I + m h²) w = J h`; the block falls if that
/// energy exceeds what lifts its centre over the edge, and the lead along with it.
#[test]
fn the_domino_falls_from_the_impulse_it_should() {
    let rope = pendulum();
    let domino = Domino {
        foot_m: [0.0305, 0.0, 0.0],
        facing_rad: 0.0,
        thickness_m: 0.04,
        width_m: 0.1,
        height_m: 0.2,
        mass_kg: 2.0,
        friction: 0.0,
    };
    let struck_at_m = 0.18;
    let scene = Scene {
        obstacles: Vec::new(),
        domino: Some(domino),
    };
    let (t, h) = (domino.thickness_m, domino.height_m);
    let inertia = domino.mass_kg * (t * t + h * h) / 3.0;
    let rise_m = 0.5 * (t.hypot(h) - h);
    let lead_rise_m = (struck_at_m * (t / h)).powi(2) / (2.0 * rope.length_m);
    let barrier_j = G_M_S2 * (domino.mass_kg * rise_m + rope.lead_mass_kg * lead_rise_m);
    let coupled = inertia + rope.lead_mass_kg * struck_at_m * struck_at_m;
    let impulse = (2.0 * barrier_j * coupled).sqrt() / struck_at_m;
    let clamp_m = Vector3::z() * (rope.length_m + struck_at_m);
    let still = still(clamp_m, Rotation3::identity());
    for precision in [Precision::F64, Precision::F32] {
        for (part, falls) in [(0.95, false), (1.12, true)] {
            let v = part * impulse / rope.lead_mass_kg;
            let start = (1.0 - v * v / (2.0 * G_M_S2 * rope.length_m)).acos();
            let options = released([0.0, start, 0.0], options(precision, 1.5, 1.0));
            let run = simulate(&scene, &rope, &still, &options);
            let outcome = run.domino.unwrap();
            println!("{precision:?} {part} {v} m/s: {outcome:?}");
            assert!(outcome.peak_tilt_rad > 0.0);
            assert_eq!(outcome.down_at_s.is_some(), falls, "{part}: {outcome:?}");
        }
    }
}
