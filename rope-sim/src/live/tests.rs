use super::*;
use crate::{AttachMotion, Candidate, FrameTimes, Precision, SimOptions, Start, Watch, roll_out};

fn rope() -> RopeParams {
    RopeParams::from_array([22.0, 0.55, 0.02, 0.3, 0.008, 0.06, 0.06, 0.03, 0.8])
}

/// Swings along x, starting and ending softly.
struct Swing;

impl AttachMotion for Swing {
    fn at(&self, t_s: f64) -> FrameMotion {
        let w = core::f64::consts::TAU;
        let (s, c) = (w * t_s).sin_cos();
        FrameMotion {
            p_m: Vector3::new(0.1 * (t_s - s / w), 0.0, 1.0),
            v_m_s: Vector3::new(0.1 * (1.0 - c), 0.0, 0.0),
            a_m_s2: Vector3::new(0.1 * w * s, 0.0, 0.0),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        1.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

#[test]
fn stays_in_equilibrium_under_a_tilted_frame() {
    let tilt = nalgebra::Rotation3::from_euler_angles(0.3, 0.9, 0.2);
    let attach = FrameMotion {
        r: tilt.into_inner(),
        ..FrameMotion::world()
    };
    let mut live = LiveRope::new(&rope(), &attach, 1e-3).unwrap();
    let before = live.tip();
    live.advance(&|_| attach, 1.0);
    assert!(
        (live.tip() - before).norm() < 1e-9,
        "{}",
        live.tip() - before
    );
}

/// Turns about the vertical by more than a full turn, tilted, softly.
struct Turn;

impl AttachMotion for Turn {
    fn at(&self, t_s: f64) -> FrameMotion {
        let w = core::f64::consts::TAU;
        let (s, c) = (w * t_s).sin_cos();
        let yaw = nalgebra::Rotation3::from_axis_angle(&Vector3::z_axis(), 7.0 * (t_s - s / w));
        let tilt = nalgebra::Rotation3::from_axis_angle(&Vector3::x_axis(), 0.4);
        FrameMotion {
            r: (yaw * tilt).into_inner(),
            w_rad_s: Vector3::z() * (7.0 * (1.0 - c)),
            alpha_rad_s2: Vector3::z() * (7.0 * w * s),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        1.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

/// The batch reads continuous quaternions, the live rope those of matrices, whose
/// sign jumps: a full turn must not matter to either.
#[test]
fn follows_the_batch_simulation() {
    let motions: [&dyn AttachMotion; 2] = [&Swing, &Turn];
    for motion in motions {
        let mut live = LiveRope::new(&rope(), &motion.at(0.0), 5e-4).unwrap();
        for cycle in 1..=250 {
            live.advance(&|t| motion.at(t), f64::from(cycle) * 0.004);
        }
        let options = SimOptions {
            step_s: 5e-4,
            precision: Precision::F64,
            start: Start::Equilibrium,
            frames: FrameTimes {
                first_s: 1.0,
                period_s: 1.0,
                count: 1,
            },
            watch: Watch::NOTHING,
            horizon_s: 1.0,
            threads: 1,
        };
        let rope = rope();
        let batch = roll_out(&[Candidate::new(&rope, motion)], &options).unwrap();
        for (node, at) in live.nodes().iter().enumerate() {
            let d = (batch[0].nodes.position(0, node) - at).norm();
            assert!(d < 1e-7, "node {node} differs by {d} m");
        }
    }
}

#[test]
fn bad_input_is_named() {
    let world = FrameMotion::world();
    let mut bad = rope();
    bad.links = 0;
    assert!(matches!(
        LiveRope::new(&bad, &world, 1e-3),
        Err(SimulateError::Rope { .. })
    ));
    assert!(matches!(
        LiveRope::new(&rope(), &world, 0.0),
        Err(SimulateError::Option {
            field: "step_s",
            ..
        })
    ));
}
