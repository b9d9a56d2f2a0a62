//! Accuracy and speed on motions of the truth set, for the comparison in `benches/peers`.
//!
//! `cargo run --release -p rope-sim --example peer_speed -- CASE [CASE ...]`
//!
//! For every case and kernel (the fastest of either precision, and the one without
//! vectors): the longest step (a whole number of steps per frame) at which the tip stays
//! within 5 mm of the truth at that and every shorter step tried, and the simulated
//! seconds per CPU second there, one rope alone and with every lane filled with ropes
//! that differ by up to 1 %. One thread. JSON on stdout.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    missing_docs,
    dead_code,
    unreachable_pub,
    reason = "a measuring program may stop loudly"
)]

#[path = "../tests/support/truth.rs"]
mod truth;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rope_sim::{Candidate, Kernel, Outcome, Precision, Scene, roll_out_in_with};
use serde_json::{Value, json};
use shared_types::RopeParams;
use truth::Case;

const BOUND_MM: f64 = 5.0;
const SEED: u64 = 7;
/// Steps per frame of 1/60 s: 8.3 ms down to 0.17 ms.
const STEPS_PER_FRAME: [u32; 22] = [
    2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20, 24, 28, 32, 36, 40, 48, 64, 80, 100,
];
/// A figure counts once it took this long (s), clock ticks being 10 ms.
const MEASURED_S: f64 = 0.5;
/// Figures are the best of so many.
const REPEATS: usize = 3;
/// Ropes per lane of the kernel in the measurement with all lanes filled.
const GROUPS: usize = 4;

fn main() {
    let Some(folder) = truth::truth_folder() else {
        std::process::exit(2);
    };
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let mut rows = Vec::new();
    let kernels = [
        Precision::F32.fastest_kernel(),
        Precision::F64.fastest_kernel(),
        Kernel::ScalarF64,
    ];
    for case in truth::cases(&folder, |id| wanted.iter().any(|w| w == id)) {
        for kernel in kernels {
            rows.push(measure(&case, kernel));
        }
    }
    let document =
        json!({ "version": env!("CARGO_PKG_VERSION"), "bound_mm": BOUND_MM, "rows": rows });
    println!("{document:#}");
}

/// Longest accurate step and speed there.
fn measure(case: &Case, kernel: Kernel) -> Value {
    let Some((step_s, error_mm)) = longest_accurate_step(case, kernel) else {
        return json!({ "case": case.id, "kernel": format!("{kernel:?}"), "step_s": null });
    };
    let ropes = similar_ropes(&case.rope, GROUPS * kernel.lanes());
    let full = simulated_s_per_cpu_s(case, kernel, step_s, &ropes);
    let alone = simulated_s_per_cpu_s(case, kernel, step_s, &ropes[..1]);
    json!({
        "case": case.id,
        "kernel": format!("{kernel:?}"),
        "lanes": kernel.lanes(),
        "ropes": ropes.len(),
        "step_s": step_s,
        "tip_error_mm": error_mm,
        "cpu_ns_per_rope_step": 1e9 * step_s / full,
        "rope_s_per_cpu_s": full,
        "one_rope_s_per_cpu_s": alone,
    })
}

fn longest_accurate_step(case: &Case, kernel: Kernel) -> Option<(f64, f64)> {
    let mut longest = None;
    for per_frame in STEPS_PER_FRAME.into_iter().rev() {
        let step_s = 1.0 / (case.rate_hz * f64::from(per_frame));
        let rollout = truth::simulate(case, kernel, step_s);
        let error_mm = truth::max_tip_error_mm(case, &rollout);
        if !(error_mm <= BOUND_MM && rollout.outcome == Outcome::Clean) {
            break;
        }
        longest = Some((step_s, error_mm));
    }
    longest
}

/// `count` ropes; the first is the given one, stiffness, damping, masses and length of
/// the others differ by up to 1 %.
fn similar_ropes(rope: &RopeParams, count: usize) -> Vec<RopeParams> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut near = |value: f64| value * rng.random_range(0.99..1.01);
    let mut ropes = vec![*rope];
    ropes.resize_with(count, || RopeParams {
        length_m: near(rope.length_m),
        joint_damping_nms_per_rad: near(rope.joint_damping_nms_per_rad),
        joint_stiffness_nm_per_rad: near(rope.joint_stiffness_nm_per_rad),
        mass_per_length_kg_per_m: near(rope.mass_per_length_kg_per_m),
        lead_mass_kg: near(rope.lead_mass_kg),
        ..*rope
    });
    ropes
}

/// Rope-seconds simulated per second of this process's CPU time, everything included:
/// the attach motion, recording all nodes at the frames, checks of divergence.
fn simulated_s_per_cpu_s(case: &Case, kernel: Kernel, step_s: f64, ropes: &[RopeParams]) -> f64 {
    let options = truth::options_of(case, step_s);
    let candidates: Vec<Candidate> = ropes
        .iter()
        .map(|rope| Candidate::new(rope, &case.motion))
        .collect();
    let mut best = 0.0_f64;
    for _ in 0..REPEATS {
        let started_s = cpu_s();
        let mut simulated_s = 0.0;
        while cpu_s() - started_s < MEASURED_S {
            roll_out_in_with(kernel, &Scene::EMPTY, &candidates, &options).unwrap();
            simulated_s += options.horizon_s * ropes.len() as f64;
        }
        best = best.max(simulated_s / (cpu_s() - started_s));
    }
    best
}

/// CPU time (s) of the process so far, in ticks of 10 ms.
fn cpu_s() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    // The second field is the program's name in brackets and may hold blanks.
    let after_name = text.rsplit(')').next().unwrap();
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    let ticks = |index: usize| fields[index].parse::<f64>().unwrap();
    (ticks(11) + ticks(12)) / 100.0
}
