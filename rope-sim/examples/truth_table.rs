//! Largest tip error against all reference trajectories, by kernel and step.
//!
//! `cargo run --release -p rope-sim --example truth_table -- [step_ms ...]`
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

use rope_sim::{Outcome, Precision};

fn main() {
    let Some(folder) = truth::truth_folder() else {
        return;
    };
    let mut steps_ms: Vec<f64> = std::env::args()
        .skip(1)
        .map(|a| a.parse().expect("steps in ms"))
        .collect();
    if steps_ms.is_empty() {
        steps_ms = vec![1.0, 0.5, 0.25];
    }
    let kernels = [Precision::F64, Precision::F32].map(Precision::fastest_kernel);
    print!("largest tip error (mm); * repeated at h/4, ! diverged\ncase ");
    for kernel in kernels {
        for step in &steps_ms {
            let single = kernel.is_single_precision();
            print!(" {:>8} {step:>3}", if single { "f32" } else { "f64" });
        }
    }
    println!();
    for case in truth::cases(&folder, |_| true) {
        let mut line = String::new();
        for kernel in kernels {
            for step_ms in &steps_ms {
                let rollout = truth::simulate(&case, kernel, step_ms * 1e-3);
                let mark = match rollout.outcome {
                    Outcome::Clean => ' ',
                    Outcome::RerunAtQuarterStep => '*',
                    Outcome::Diverged => '!',
                };
                let error = truth::max_tip_error_mm(&case, &rollout);
                line += &format!(" {error:>11.4}{mark}");
            }
        }
        println!("{}{line}", case.id);
    }
}
