//! Ropes, motions and options that the tests share.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "every test file compiles its own copy"
)]

pub mod contact;
pub mod fling;
pub mod pushed;
pub mod truth;

use arm_model::kinematics::FrameMotion;
use arm_model::{JointTrajectory, JointVector, Pole};
use nalgebra::{Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, PlannedArm, Precision, Rollout, Scene, SimOptions, Start,
    roll_out_in,
};
use shared_types::{AirDrag, RopeParams};

pub const G_M_S2: f64 = 9.81;

pub const AIR: AirDrag = AirDrag {
    air_density_kg_m3: 1.2,
    normal_coefficient: 1.1,
    tangential_coefficient: 0.02,
    lead_coefficient: 0.5,
};

/// A soft rope whose links' inertia follows from the extra scale.
pub fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.01, 0.2, 0.008, 0.06, 0.06, 0.03, 0.8])
}

/// One rigid link with a lead: a pendulum. Also its inertia about the clamp (kg m²) and
/// its weight's greatest moment (N m).
pub fn pendulum() -> (RopeParams, f64, f64) {
    let rope = RopeParams::from_array([1.0, 0.5, 0.0, 0.0, 0.01, 0.06, 0.05, 0.03, 0.5]);
    let (s, m, m_lead) = (rope.length_m, rope.link_mass_kg(), rope.lead_mass_kg);
    let inertia =
        rope.link_inertia_kg_m2() + m * s * s / 4.0 + rope.lead_inertia_kg_m2() + m_lead * s * s;
    (rope, inertia, G_M_S2 * s * (m / 2.0 + m_lead))
}

/// A throw that starts and stops with a jump of acceleration, off the grid of steps; its
/// middle waypoint is moved by `offset` at joint 2 (rad).
pub fn throw(offset: f64) -> PlannedArm {
    let waypoints = [
        JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
        JointVector([0.2, -0.3 + offset, 0.2, 0.8, -0.2, 1.2, 0.3]),
        JointVector([0.1, -0.5, 0.1, 1.0, 0.1, 1.6, -0.2]),
    ];
    PlannedArm::new(
        JointTrajectory::new(&[0.0, 0.2137, 0.4511], &waypoints).unwrap(),
        Pole::default(),
    )
}

/// A frame that stands still at the origin.
pub fn world(_t_s: f64) -> FrameMotion {
    FrameMotion::world()
}

/// A frame that stands still.
pub fn still(p_m: Vector3<f64>, r: Rotation3<f64>) -> impl AttachMotion + Copy {
    move |_t_s: f64| FrameMotion {
        p_m,
        r: r.into_inner(),
        ..FrameMotion::world()
    }
}

/// Steps of 0.5 ms from equilibrium, all nodes recorded at `rate_hz` up to the horizon.
pub fn options(precision: Precision, horizon_s: f64, rate_hz: f64) -> SimOptions {
    SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / rate_hz,
            count: (horizon_s * rate_hz + 1e-6) as usize + 1,
        },
        ..SimOptions::new(5e-4, precision, horizon_s)
    }
}

/// The same from a straight rope whose joint 0 is turned (rad).
pub fn released(joint0_rotvec: [f64; 3], options: SimOptions) -> SimOptions {
    SimOptions {
        start: Start::Straight { joint0_rotvec },
        ..options
    }
}

pub fn simulate(
    scene: &Scene,
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    options: &SimOptions,
) -> Rollout {
    roll_out_in(scene, &[Candidate::new(rope, motion)], options)
        .unwrap()
        .remove(0)
}

/// The lead at all frames.
pub fn tips(rollout: &Rollout) -> Vec<Vector3<f64>> {
    let last = rollout.nodes.nodes() - 1;
    (0..rollout.nodes.frames())
        .map(|f| rollout.nodes.position(f, last))
        .collect()
}

/// Asserts that velocities and accelerations of a motion are the derivatives of its poses.
pub fn assert_derivatives(motion: &dyn AttachMotion, times_s: impl IntoIterator<Item = f64>) {
    let d = 1e-5;
    for t in times_s {
        let (before, now, after) = (motion.at(t - d), motion.at(t), motion.at(t + d));
        let v = (after.p_m - before.p_m) / (2.0 * d);
        let a = (after.v_m_s - before.v_m_s) / (2.0 * d);
        let alpha = (after.w_rad_s - before.w_rad_s) / (2.0 * d);
        let turned = (after.r - before.r) / (2.0 * d);
        assert!((v - now.v_m_s).norm() < 1e-6, "velocity at {t}");
        assert!((a - now.a_m_s2).norm() < 1e-4, "acceleration at {t}");
        assert!((alpha - now.alpha_rad_s2).norm() < 1e-4, "alpha at {t}");
        assert!((turned - now.w_rad_s.cross_matrix() * now.r).norm() < 1e-6);
    }
}
