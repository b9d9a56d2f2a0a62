//! Lays a rope over a wall with a moving arm's end and prints what came of it.

use nalgebra::Vector3;
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Obstacle, Precision, Scene, Shape, SimOptions, Start,
    Watch, roll_out_in,
};
use shared_types::RopeParams;
use shared_types::kinematics::FrameMotion;

/// Middle of the wall's top edge (m).
const TARGET_M: [f64; 3] = [0.75, 0.0, 0.30];

/// Forth over the wall and half the way back, in smooth strokes of a second.
struct OverAndBack;

impl AttachMotion for OverAndBack {
    fn at(&self, t_s: f64) -> FrameMotion {
        let w = core::f64::consts::TAU;
        let (from_m, way_m, t) = if t_s < 1.0 {
            (0.45, 0.5, t_s.max(0.0))
        } else {
            (0.95, -0.35, (t_s - 1.0).clamp(0.0, 1.0))
        };
        let (s, c) = (w * t).sin_cos();
        FrameMotion {
            p_m: Vector3::new(from_m + way_m * (t - s / w), 0.0, 0.95),
            v_m_s: Vector3::x() * (way_m * (1.0 - c)),
            a_m_s2: Vector3::x() * (way_m * w * s),
            ..FrameMotion::world()
        }
    }
    fn duration_s(&self) -> f64 {
        2.0
    }
    fn acceleration_jumps_s(&self) -> Vec<f64> {
        Vec::new()
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [x, y, z] = TARGET_M;
    let wall = Shape::Box {
        half_m: [0.01, 0.30, 0.20],
    };
    let scene = Scene {
        obstacles: vec![Obstacle::fixed(wall, [x, y, z - 0.20], 0.5)],
        domino: None,
    };
    let rope = RopeParams::from_array([22.0, 0.65, 0.01, 0.05, 0.005, 0.04, 0.03, 0.02, 0.8]);
    let options = SimOptions {
        step_s: 5e-4,
        precision: Precision::F32,
        start: Start::Equilibrium,
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 0.5,
            count: 13,
        },
        watch: Watch::default(),
        horizon_s: 6.0,
        threads: 1,
    };
    for run in roll_out_in(&scene, &[Candidate::new(&rope, &OverAndBack)], &options)? {
        for frame in 0..run.nodes.frames() {
            let (tip, middle) = (run.nodes.position(frame, 22), run.nodes.position(frame, 11));
            let t_s = options.frames.time_s(frame);
            println!(
                "{t_s:.1} s: tip {:.3} {:.3}, middle {:.3} {:.3}",
                tip.x, tip.z, middle.x, middle.z
            );
        }
        println!("{:?}, wall: {:?}", run.outcome, run.contacts);
    }
    Ok(())
}
