//! Runs the planner's CMA-ES on standard functions and prints one line per run, for
//! `cmaes/checks/cmaes_peer.py` to compare with the package `cma`.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use cmaes::{CmaEs, CmaOptions, StopReason};

const TARGET: f64 = 1e-8;
const EVALUATIONS_MAX: usize = 400_000;

/// Name, mean and deviation of the first generation, and the function.
type Case = (&'static str, f64, f64, fn(&[f64]) -> f64);

const CASES: [Case; 5] = [
    ("sphere", 3.0, 1.0, |x| x.iter().map(|v| v * v).sum()),
    ("ellipsoid", 3.0, 1.0, |x| {
        let part = |i: usize| i as f64 / (x.len() - 1) as f64;
        (0..x.len())
            .map(|i| 1e6f64.powf(part(i)) * x[i] * x[i])
            .sum()
    }),
    ("rosenbrock", 0.0, 0.5, |x| {
        x.windows(2)
            .map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2))
            .sum()
    }),
    ("different powers", 3.0, 1.0, |x| {
        let part = |i: usize| i as f64 / (x.len() - 1) as f64;
        (0..x.len())
            .map(|i| x[i].abs().powf(2.0 + 4.0 * part(i)))
            .sum()
    }),
    ("rastrigin", 3.0, 2.0, |x| {
        x.iter()
            .map(|v| v * v - 10.0 * (core::f64::consts::TAU * v).cos() + 10.0)
            .sum()
    }),
];

fn line((name, mean, std_dev, f): &Case, n: usize, population: Option<usize>, seeds: u64) {
    for seed in 0..seeds {
        let mut options = CmaOptions::unbounded(vec![*mean; n], *std_dev, seed);
        options.population = population.unwrap_or(options.population);
        options.stop.fitness_target = TARGET;
        let population = options.population;
        options.stop.generations_max = EVALUATIONS_MAX.div_ceil(population);
        let mut search = CmaEs::new(options).expect("sound options");
        while search.stop().is_none() {
            let x = search.ask(&mut |_| true).expect("all is feasible");
            let values: Vec<f64> = x.iter().map(|x| f(x)).collect();
            search.tell(&values).expect("one value per candidate");
        }
        println!(
            "{name},{n},{seed},{population},{},{}",
            search.generation() * population,
            search.stop() == Some(StopReason::FitnessTarget)
        );
    }
}

/// `cmaes_table [SEEDS] [FUNCTION]`: 20 seeds of all functions if left out.
fn main() {
    let seeds = std::env::args()
        .nth(1)
        .map_or(20, |s| s.parse().expect("a number of seeds"));
    let only = std::env::args().nth(2);
    let wanted = |case: &Case| only.as_ref().is_none_or(|name| name == case.0);
    println!("function,dimensions,seed,population,evaluations,solved");
    for (n, many) in [(9, 180), (21, 420)] {
        for case in CASES.iter().filter(|case| wanted(case)) {
            let population = (case.0 == "rastrigin").then_some(many);
            line(case, n, population, seeds);
        }
    }
}
