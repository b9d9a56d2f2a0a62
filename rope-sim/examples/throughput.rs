//! CPU time per rope and step, by kernel, with and without the attach motion.
//!
//! `cargo run --release -p rope-sim --example throughput`
#![allow(
    clippy::unwrap_used,
    missing_docs,
    reason = "a measuring program may stop loudly"
)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rope_sim::{
    Candidate, FrameTimes, Kernel, Outcome, PlannedArm, Precision, SimOptions, Start, Watch,
    roll_out_with,
};
use shared_types::{JointTrajectory, JointVector, RopeParams};

const POSE: [f64; 7] = [0.0, -0.5, 0.0, 1.0, 0.0, 1.6, 0.0];

fn rope(random: &mut ChaCha8Rng) -> RopeParams {
    let mut v = shared_types::rope::RANGES.map(|r| random.random_range(r.min..r.max));
    v[0] = 22.0;
    RopeParams::from_array(v)
}

/// Waypoints every 0.15 s around the pose, for 0.9 s.
fn throw(random: &mut ChaCha8Rng) -> PlannedArm {
    let times: Vec<f64> = (0..7).map(|i| 0.15 * f64::from(i)).collect();
    let mut q = POSE;
    let waypoints: Vec<JointVector> = times
        .iter()
        .map(|_| {
            for (joint, angle) in q.iter_mut().enumerate() {
                *angle += if joint % 2 == 1 {
                    random.random_range(-0.15..0.15)
                } else {
                    0.0
                };
            }
            JointVector(q)
        })
        .collect();
    PlannedArm::new(JointTrajectory::new(&times, &waypoints).unwrap())
}

/// 25 degrees of joint 6 at 0.75 Hz.
fn wiggle() -> PlannedArm {
    let times: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
    let waypoints: Vec<JointVector> = times
        .iter()
        .map(|t| {
            let mut q = POSE;
            q[5] += 0.436 * (core::f64::consts::TAU * 0.75 * t).sin();
            JointVector(q)
        })
        .collect();
    PlannedArm::new(JointTrajectory::new(&times, &waypoints).unwrap())
}

/// Processor time of this thread (s), from the kernel's scheduler statistics.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    text.split_whitespace()
        .next()
        .unwrap()
        .parse::<f64>()
        .unwrap()
        * 1e-9
}

fn measure(name: &str, kernel: Kernel, candidates: &[Candidate], options: &SimOptions) {
    let started_s = cpu_s();
    let rollouts = roll_out_with(kernel, candidates, options).unwrap();
    let spent_s = cpu_s() - started_s;
    let steps = options.horizon_s / options.step_s * rollouts.len() as f64;
    let count = |outcome| rollouts.iter().filter(|r| r.outcome == outcome).count();
    println!(
        "{name:<9} {:<12} {:>5} ropes {:>7.1} ns per rope-step {spent_s:>7.2} s  repeated {} diverged {}",
        format!("{kernel:?}"),
        rollouts.len(),
        spent_s / steps * 1e9,
        count(Outcome::RerunAtQuarterStep),
        count(Outcome::Diverged),
    );
}

fn main() {
    let scale: usize = std::env::args()
        .nth(1)
        .and_then(|a| a.parse().ok())
        .unwrap_or(1);
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let ropes: Vec<RopeParams> = (0..3000).map(|_| rope(&mut random)).collect();
    let throws: Vec<PlannedArm> = (0..1500).map(|_| throw(&mut random)).collect();
    let wiggle = wiggle();
    let fast = [Precision::F32, Precision::F64].map(Precision::fastest_kernel);
    for kernel in Kernel::ALL.into_iter().filter(|k| k.is_available()) {
        let share = if fast.contains(&kernel) {
            scale
        } else {
            10 * scale
        };
        let options = SimOptions {
            step_s: 5e-4,
            precision: Precision::F32,
            start: Start::Equilibrium,
            frames: FrameTimes::NONE,
            watch: Watch::point([1.2, 0.0, 0.6]),
            horizon_s: 1.5,
            threads: 1,
        };
        let throwing: Vec<Candidate> = throws
            .iter()
            .take(1500 / share)
            .map(|motion| Candidate::new(&ropes[0], motion))
            .collect();
        measure("throws", kernel, &throwing, &options);
        let wiggling: Vec<Candidate> = ropes
            .iter()
            .take(3000 / share)
            .map(|rope| Candidate::new(rope, &wiggle))
            .collect();
        let frames = FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / 60.0,
            count: 400,
        };
        let options = SimOptions {
            step_s: 1e-3,
            frames,
            watch: Watch::NOTHING,
            horizon_s: 6.67,
            ..options
        };
        measure("wiggles", kernel, &wiggling, &options);
    }
}
