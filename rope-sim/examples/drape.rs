//! Lays a rope over a wall with a moving arm's end and prints what came of it.

use arm_model::kinematics::FrameMotion;
use nalgebra::Vector3;
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Obstacle, Precision, Scene, SimOptions, Start, Watch,
    roll_out_in,
};
use shared_types::RopeParams;

/// Middle of the wall's top edge (m).
const TARGET_M: [f64; 3] = [0.75, 0.0, 0.30];

/// Forth over the wall, then down behind it and a little back, in smooth strokes.
struct OverAndDown;

impl AttachMotion for OverAndDown {
    fn at(&self, t_s: f64) -> FrameMotion {
        let w = core::f64::consts::TAU;
        let (from_m, way_m, t) = if t_s < 1.0 {
            (
                Vector3::new(0.45, 0.0, 1.05),
                Vector3::x() * 0.45,
                t_s.max(0.0),
            )
        } else {
            let back_m = Vector3::new(-0.30, 0.0, -0.35);
            (Vector3::new(0.90, 0.0, 1.05), back_m, (t_s - 1.0).min(1.0))
        };
        let (s, c) = (w * t).sin_cos();
        FrameMotion {
            p_m: from_m + way_m * (t - s / w),
            v_m_s: way_m * (1.0 - c),
            a_m_s2: way_m * (w * s),
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
    let wall = Obstacle::box_below(TARGET_M, [0.02, 0.60, 0.40], 0.5);
    let scene = Scene::with(vec![wall, Obstacle::floor(-0.75, 0.5)]);
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
    for run in roll_out_in(&scene, &[Candidate::new(&rope, &OverAndDown)], &options)? {
        for frame in 0..run.nodes.frames() {
            let (tip, middle) = (run.nodes.position(frame, 22), run.nodes.position(frame, 11));
            let t_s = options.frames.time_s(frame);
            println!(
                "{t_s:.1} s: tip {:.3} {:.3}, middle {:.3} {:.3}",
                tip.x, tip.z, middle.x, middle.z
            );
        }
        println!("{:?}, wall and floor: {:?}", run.outcome, run.contacts);
    }
    Ok(())
}
