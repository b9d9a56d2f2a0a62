//! Identifies random ropes from simulated films with the paper's noise and prints the
//! errors.
//!
//! `identify_table [--ropes 50] [--seed 1] [--first 0] [--cmaes 1] [--verbose 1]
//! [--tracking 3.0] [--degrees 16.5] [--hertz 1.3]`
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    reason = "an example may stop with a message"
)]

use experiments::trials::{Trial, TrialRig, summarise, trial_rope};
use planner::sysid::{IdentifyOptions, Method};
use planner::wiggle::WiggleConfig;
use std::time::Instant;

fn number<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::args()
        .skip_while(|a| a != &format!("--{name}"))
        .nth(1)
        .map_or(default, |v| {
            v.parse()
                .unwrap_or_else(|_| panic!("--{name} {v} is not a number"))
        })
}

fn main() {
    let config = WiggleConfig {
        amplitude_rad: number("degrees", 16.5f64).to_radians(),
        frequency_hz: number("hertz", 1.3),
        ..WiggleConfig::default()
    };
    let mut rig = TrialRig::new(&config).expect("a wiggle within the limits");
    rig.randomisation.tracking_px[1] = number("tracking", 3.0);
    let seed = number("seed", 1u64);
    let options = IdentifyOptions {
        seed,
        method: if number("cmaes", 0) == 1 {
            Method::Cmaes
        } else {
            Method::Hybrid
        },
        ..IdentifyOptions::default()
    };
    let first = number("first", 0u64);
    let mut trials = Vec::new();
    let mut seconds = 0.0;
    for index in first..first + number("ropes", 50u64) {
        let rope = trial_rope(seed, index);
        let filmed = rig.film(&rope, seed, index).expect("a rope of the ranges");
        let start = Instant::now();
        let found = rig
            .fit(&filmed, index, &options)
            .expect("a rope of the ranges");
        let took = start.elapsed().as_secs_f64();
        seconds += took;
        let trial = Trial::new(index, &rope, &found);
        if number("verbose", 0) == 1 {
            let c = &found.circumstances;
            let z: Vec<f64> = (0..9)
                .map(|i| {
                    (trial.found[i] - trial.truth[i]) / found.posterior.covariance[i][i].sqrt()
                })
                .collect();
            println!(
                "{index} {took:.2} s, {} sims, {:.3} px, novelty {:.2}, inflation {:.2}, clock {:.4}\n  true  {:.4?}\n  found {:.4?}\n  z     {z:.2?}\n  noise {:.2?} {:.2?} camera {:.4?} {:.4?}",
                found.simulations,
                found.residual_px,
                found.novelty.score,
                found.posterior.inflation,
                found.time_offset_s,
                trial.truth,
                trial.found,
                [
                    c.noise_along.sigma_px,
                    c.noise_along.in_time,
                    c.noise_along.along_rope
                ],
                [
                    c.noise_across.sigma_px,
                    c.noise_across.in_time,
                    c.noise_across.along_rope
                ],
                c.camera_position_m,
                c.camera_rotation_rad,
            );
        }
        trials.push(trial);
    }
    let s = summarise(&trials);
    for row in &s.parameters {
        println!(
            "{:18} mean {:9.5}  median {:9.5}  paper {:7.4}  middle {:7.4}  best {:7.4}  coverage {:.3}",
            row.label,
            row.mean_error,
            row.median_error,
            row.paper,
            row.middle,
            row.best_possible.unwrap_or(f64::NAN),
            row.coverage
        );
    }
    for row in &s.ratios {
        println!(
            "{:42} median {:7.4}  p90 {:7.4}",
            row.label, row.median, row.p90
        );
    }
    println!(
        "outside {:.3}, residual {:.3} px, {:.0} simulations, {:.2} s each",
        s.taken_for_outside,
        s.residual_px,
        s.simulations,
        seconds / trials.len().max(1) as f64
    );
}
