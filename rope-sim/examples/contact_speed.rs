//! What obstacles cost: CPU time per rope and step by kernel and by how near the
//! obstacles are, and the outcome of the comparison with the rope alone.
//!
//! `cargo run --release -p rope-sim --example contact_speed`
//!
//! Figures are the least of several runs on one thread, everything included.
#![allow(
    clippy::unwrap_used,
    missing_docs,
    reason = "a measuring program may stop loudly"
)]

use arm_model::kinematics::FrameMotion;
use nalgebra::{Isometry3, Rotation3, Vector3};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, Kernel, Obstacle, Placement, Precision, Scene, Shape,
    SimOptions, Start, Watch, roll_out_in_with,
};
use shared_types::RopeParams;

const KERNELS: [Kernel; 4] = [
    Kernel::Avx512F32,
    Kernel::Avx2F32,
    Kernel::Avx512F64,
    Kernel::ScalarF64,
];
const STEP_S: f64 = 5e-4;
const HORIZON_S: f64 = 2.0;
/// Groups of lanes per run.
const GROUPS: usize = 2;
const REPEATS: usize = 5;

/// Sways a little along x and y, so that nothing ever rests.
struct Sway {
    height_m: f64,
}

impl AttachMotion for Sway {
    fn at(&self, t_s: f64) -> FrameMotion {
        let w = core::f64::consts::TAU;
        let (s, c) = (w * t_s).sin_cos();
        let way = Vector3::new(0.05, 0.02, 0.0);
        FrameMotion {
            p_m: Vector3::z() * self.height_m + way * (1.0 - c),
            v_m_s: way * (w * s),
            a_m_s2: way * (w * w * c),
            // Off the vertical: a straight rope pushed from below would be a rod.
            r: Rotation3::from_axis_angle(&Vector3::y_axis(), 0.3).into_inner(),
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

/// An arrangement: the obstacles, the height of the attach frame, whether the rope
/// starts lying straight along x instead of hanging.
struct Case {
    name: &'static str,
    scene: Scene,
    height_m: f64,
    joint0_rotvec: Option<[f64; 3]>,
}

fn among(obstacles: Vec<Obstacle>) -> Scene {
    Scene {
        obstacles,
        domino: None,
    }
}

fn floor() -> Scene {
    among(vec![Obstacle::fixed(Shape::HalfSpace, [0.0; 3], 0.5)])
}

fn cases() -> Vec<Case> {
    let hanging = |name, scene, height_m| Case {
        name,
        scene,
        height_m,
        joint0_rotvec: None,
    };
    let pole = Obstacle {
        shape: Shape::Capsule {
            half_length_m: 0.1,
            radius_m: 0.008,
        },
        placement: Placement::Attach(Isometry3::translation(0.0, 0.0, 0.1)),
        friction: 0.5,
    };
    let wall = Shape::Box {
        half_m: [0.01, 0.3, 0.2],
    };
    vec![
        hanging("alone", Scene::EMPTY, 1.0),
        hanging("far", floor(), 5.0),
        hanging("near, untouched", floor(), 0.7),
        hanging("pole, untouched", among(vec![pole]), 1.0),
        Case {
            name: "floor, lead and some links",
            scene: floor(),
            height_m: 0.45,
            joint0_rotvec: Some([0.0, -1.4, 0.0]),
        },
        Case {
            name: "floor, all links",
            scene: floor(),
            height_m: 0.01,
            joint0_rotvec: Some([0.0, -1.85, 0.0]),
        },
        Case {
            name: "draped over a wall",
            scene: among(vec![Obstacle::fixed(wall, [0.25, 0.0, 0.0], 0.5)]),
            height_m: 0.25,
            joint0_rotvec: Some([0.0, -1.85, 0.0]),
        },
    ]
}

/// CPU time of one rope's step (ns), and how much of the time it was in touch.
fn cost(kernel: Kernel, case: &Case) -> (f64, f64) {
    let options = SimOptions {
        step_s: STEP_S,
        precision: Precision::F32,
        start: case
            .joint0_rotvec
            .map_or(Start::Equilibrium, |joint0_rotvec| Start::Straight {
                joint0_rotvec,
            }),
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0,
            count: 1,
        },
        watch: Watch::NOTHING,
        horizon_s: HORIZON_S,
        threads: 1,
    };
    let count = GROUPS * kernel.lanes();
    let ropes: Vec<RopeParams> = (0..count)
        .map(|i| {
            let more = 1.0 + 0.002 * i as f64;
            let length_m = 0.55 * more;
            RopeParams::from_array([22.0, length_m, 0.01, 0.05, 0.005, 0.05, 0.03, 0.02, 0.8])
        })
        .collect();
    let sway = Sway {
        height_m: case.height_m,
    };
    let candidates: Vec<Candidate> = ropes.iter().map(|r| Candidate::new(r, &sway)).collect();
    let steps = count as f64 * HORIZON_S / STEP_S;
    let (mut least_ns, mut touch_s) = (f64::INFINITY, 0.0);
    for _ in 0..REPEATS {
        let began_ns = cpu_ns();
        let runs = roll_out_in_with(kernel, &case.scene, &candidates, &options).unwrap();
        least_ns = least_ns.min(cpu_ns() - began_ns);
        touch_s = runs
            .iter()
            .flat_map(|r| &r.contacts)
            .fold(0.0, |sum, c| sum + c.in_touch_s);
    }
    (least_ns / steps, touch_s / (count as f64 * HORIZON_S))
}

/// CPU time (ns) of the process's first thread so far.
fn cpu_ns() -> f64 {
    let text = std::fs::read_to_string("/proc/self/schedstat").unwrap();
    text.split_whitespace().next().unwrap().parse().unwrap()
}

fn main() {
    for kernel in KERNELS.into_iter().filter(|k| k.is_available()) {
        let mut alone_ns = f64::NAN;
        for case in cases() {
            let (ns, touch) = cost(kernel, &case);
            if case.scene.is_empty() {
                alone_ns = ns;
            }
            println!(
                "{kernel:?}, {}: {ns:.0} ns per rope-step, {:.2} times alone, {:.0} % in touch",
                case.name,
                ns / alone_ns,
                100.0 * touch
            );
        }
    }
}
