//! Behaviour that follows from mechanics alone.
#![cfg(test)]
#![allow(clippy::float_cmp, missing_docs, reason = "a test")]

use arm_model::kinematics::FrameMotion;
use arm_model::{JointTrajectory, JointVector, Pole};
use nalgebra::{Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, PlannedArm, Precision, Rollout, SimOptions, Start, Watch,
    roll_out,
};
use shared_types::RopeParams;

const G: f64 = 9.81;

/// A frame that stands still.
struct Fixed(FrameMotion);

impl AttachMotion for Fixed {
    fn at(&self, _t_s: f64) -> FrameMotion {
        self.0
    }
    fn duration_s(&self) -> f64 {
        f64::INFINITY
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

fn simulate(rope: &RopeParams, motion: &dyn AttachMotion, options: &SimOptions) -> Rollout {
    roll_out(&[Candidate::new(rope, motion)], options)
        .unwrap()
        .remove(0)
}

fn options(horizon_s: f64, rate_hz: f64) -> SimOptions {
    SimOptions {
        step_s: 2.5e-4,
        precision: Precision::F64,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / rate_hz,
            count: (horizon_s * rate_hz).round() as usize + 1,
        },
        watch: Watch::NOTHING,
        horizon_s,
        threads: 1,
    }
}

/// One rigid link is a pendulum; its period at any amplitude is an arithmetic-geometric
/// mean.
#[test]
fn one_link_swings_with_the_period_of_a_pendulum() {
    let rope = RopeParams::from_array([1.0, 0.5, 0.0, 0.0, 0.01, 0.06, 0.05, 0.03, 0.5]);
    let amplitude = 1.2_f64;
    let (s, m, m_lead) = (rope.length_m, rope.link_mass_kg(), rope.lead_mass_kg);
    let inertia =
        rope.link_inertia_kg_m2() + m * s * s / 4.0 + rope.lead_inertia_kg_m2() + m_lead * s * s;
    let (mut a, mut b) = (1.0, (amplitude / 2.0).cos());
    for _ in 0..6 {
        (a, b) = ((a + b) / 2.0, (a * b).sqrt());
    }
    let slow = core::f64::consts::TAU * (inertia / (G * s * (m / 2.0 + m_lead))).sqrt();
    let period_s = slow / a;
    let mut options = options(period_s, 1.0 / period_s);
    options.start = Start::Straight {
        joint0_rotvec: [0.0, amplitude, 0.0],
    };
    options.frames = FrameTimes {
        first_s: 0.0,
        period_s: period_s / 4.0,
        count: 5,
    };
    let rollout = simulate(&rope, &Fixed(FrameMotion::world()), &options);
    // A quarter of the way it hangs straight down, after a whole period it is back.
    let down = rollout.nodes.position(1, 1);
    assert!(down.x.abs() < 1e-5 * s, "{down}");
    let back = rollout.nodes.position(4, 1) - rollout.nodes.position(0, 1);
    assert!(back.norm() < 1e-5 * s, "{back}");
    let fastest = (2.0 * G * s * (m / 2.0 + m_lead) * (1.0 - amplitude.cos()) / inertia).sqrt() * s;
    assert!((rollout.peak_tip_speed_m_s / fastest - 1.0).abs() < 1e-4);
    assert!((rollout.max_joint_angle_rad - amplitude).abs() < 1e-3);
}

/// The motion of all links about a fixed point conserves energy when nothing damps.
#[test]
fn undamped_energy_is_kept() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.0, 0.1, 0.008, 0.06, 0.06, 0.03, 1.2]);
    let rate = 4000.0;
    let mut options = options(0.6, rate);
    options.step_s = 1.0 / rate / 4.0;
    // Two lever arms out of one plane: turned about an oblique axis, swinging.
    options.start = Start::Straight {
        joint0_rotvec: [0.05, 0.1, 0.0],
    };
    let rollout = simulate(&rope, &Fixed(FrameMotion::world()), &options);
    let energy = |frame: usize| energy_j(&rope, &rollout, frame, rate);
    let (start, scale) = (energy(1), {
        let drop = rollout.nodes.position(0, 22).z + rope.length_m;
        rope.lead_mass_kg * G * drop
    });
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
            + rope.link_mass_kg() * G * height
            + 0.5 * rope.joint_stiffness_nm_per_rad * angle * angle;
        above = direction;
    }
    sum + 0.5 * rope.lead_mass_kg * velocity(n).norm_squared()
        + rope.lead_mass_kg * G * node(frame, n).z
}

#[test]
fn equilibrium_stays_where_it_is_and_links_keep_their_length() {
    let rope = RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0]);
    let tilt = Rotation3::from_euler_angles(0.5, -0.8, 0.3).into_inner();
    let motion = Fixed(FrameMotion {
        r: tilt,
        ..FrameMotion::world()
    });
    for (precision, bound_m) in [(Precision::F64, 1e-9), (Precision::F32, 2e-5)] {
        let rollout = simulate(
            &rope,
            &motion,
            &SimOptions {
                precision,
                ..options(2.0, 10.0)
            },
        );
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

/// An arm that starts and stops with a jump of acceleration, off the grid of steps.
fn clamped_arm() -> PlannedArm {
    let waypoints = [
        JointVector([0.0, -0.6, 0.0, 0.9, 0.0, 1.5, 0.0]),
        JointVector([0.2, -0.3, 0.2, 0.8, -0.2, 1.2, 0.3]),
        JointVector([0.1, -0.5, 0.1, 1.0, 0.1, 1.6, -0.2]),
    ];
    PlannedArm::new(
        JointTrajectory::new(&[0.0, 0.2137, 0.4511], &waypoints).unwrap(),
        Pole::default(),
    )
}

#[test]
fn acceleration_jumps_do_not_cost_the_order() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.02, 0.3, 0.008, 0.06, 0.06, 0.03, 0.8]);
    let tips = |step_s| {
        let rollout = simulate(
            &rope,
            &clamped_arm(),
            &SimOptions {
                step_s,
                ..options(0.9, 100.0)
            },
        );
        (0..rollout.nodes.frames())
            .map(|f| rollout.nodes.position(f, 22))
            .collect::<Vec<_>>()
    };
    let truth = tips(3.125e-5);
    let error = |step_s| {
        let differences = tips(step_s)
            .into_iter()
            .zip(&truth)
            .map(|(a, b)| (a - b).norm());
        differences.fold(0.0, f64::max)
    };
    let (coarse, fine) = (error(1e-3), error(2.5e-4));
    assert!(coarse < 5e-4, "{coarse} m at 1 ms");
    assert!(
        (coarse / fine).log2() / 2.0 > 1.7,
        "{coarse} m at 1 ms, {fine} m at 0.25 ms"
    );
}

#[test]
fn closest_approach_is_that_of_the_recorded_path() {
    let rope = RopeParams::from_array([22.0, 0.55, 0.01, 0.2, 0.008, 0.06, 0.06, 0.03, 0.8]);
    let target = [0.45, 0.1, 0.05];
    for precision in [Precision::F32, Precision::F64] {
        let options = SimOptions {
            watch: Watch::point(target),
            precision,
            step_s: 5e-4,
            ..options(0.9, 20_000.0)
        };
        let rollout = simulate(&rope, &clamped_arm(), &options);
        let distance = |f: usize| (rollout.nodes.position(f, 22) - Vector3::from(target)).norm();
        let (mut best, mut best_frame) = (f64::INFINITY, 0);
        for frame in 0..rollout.nodes.frames() {
            if distance(frame) < best {
                (best, best_frame) = (distance(frame), frame);
            }
        }
        let closest = rollout.watched.to_point.unwrap();
        assert!(
            (closest.distance_m - best).abs() < 2e-6,
            "{closest:?} against {best}"
        );
        assert!(
            (closest.time_s - best_frame as f64 / 20_000.0).abs() < 3e-4,
            "{closest:?}"
        );
    }
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
    let mut options = options(0.5, 20.0);
    options.start = Start::Straight {
        joint0_rotvec: [0.4, 0.7, 0.3],
    };
    let fixed = Fixed(FrameMotion::world());
    let (a, b) = (
        simulate(&rope, &fixed, &options),
        simulate(&scaled, &fixed, &options),
    );
    for (x, y) in a.nodes.to_f64().into_iter().zip(b.nodes.to_f64()) {
        assert!((x - y).abs() < 1e-9);
    }
}
