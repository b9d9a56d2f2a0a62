//! Plans throws for random ropes and prints how well they do.
//!
//! Errors are given for the rope planned for, as the root mean square over ropes off by
//! what identification leaves open, and as the fraction of those that succeeds.
#![allow(clippy::expect_used, reason = "an example may stop with a message")]

use arm_model::Limits;
use arm_model::limits::LimitsSpec;
use clap::Parser;
use experiments::trials::{mean, quantile};
use planner::PlannerConfig;
use planner::plan::{
    Dimensions, PlanOptions, PlanRequest, Robustness, ThrowSimulator, simulator_for,
};
use planner::ropes::{random_rope, random_strike_target};
use shared_types::Task;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Instant;

/// Plans throws for random ropes and prints how well they do.
#[derive(Debug, Parser)]
struct Args {
    /// strike, lob or drape.
    #[arg(long, default_value = "strike")]
    task: String,
    #[arg(long, default_value_t = 20)]
    ropes: u64,
    #[arg(long, default_value_t = 900)]
    seed: u64,
    #[arg(long, default_value_t = 1)]
    searches: usize,
    #[arg(long, default_value_t = 2)]
    threads: usize,
    /// Planner configuration (TOML) instead of the built-in one.
    #[arg(long)]
    config: Option<PathBuf>,
    /// All seven joints instead of the planar three.
    #[arg(long)]
    full: bool,
    #[arg(long, default_value_t = 1.0)]
    stretch: f64,
    /// Greatest speed of the tool centre point (m/s).
    #[arg(long)]
    speed: Option<f64>,
}

fn line(name: &str, values: &[f64]) {
    let at = |fraction| quantile(values.iter().copied(), fraction);
    println!(
        "{name:24} mean {:7.3}  median {:7.3}  p90 {:7.3}  max {:7.3}",
        mean(values.iter().copied()),
        at(0.5),
        at(0.9),
        at(1.0)
    );
}

fn main() {
    let args = Args::parse();
    let config: PlannerConfig = args.config.map_or_else(PlannerConfig::default, |path| {
        let text = std::fs::read_to_string(path).expect("--config names a file");
        toml::from_str(&text).expect("a planner file")
    });
    let kind: Task = [Task::Strike, Task::Lob, Task::Drape]
        .into_iter()
        .find(|task| task.name() == args.task)
        .expect("--task is strike, lob or drape");
    let mut spec = LimitsSpec::from(Limits::default());
    spec.tcp_speed_max_m_s = args.speed.unwrap_or(spec.tcp_speed_max_m_s);
    let limits = Limits::try_from(spec).expect("a positive speed");
    let (mut exact, mut off, mut success, mut successes) = (vec![], vec![], vec![], vec![]);
    let (mut seconds, mut simulations) = (vec![], vec![]);
    for index in 0..args.ropes {
        let seed = index + args.seed * 1000;
        let target_m = match kind {
            Task::Strike => random_strike_target(seed),
            Task::Lob => [0.85, 0.0, 0.20],
            Task::Drape => [0.75, 0.0, 0.30],
        };
        let options = PlanOptions {
            dimensions: if args.full {
                Dimensions::Full
            } else {
                Dimensions::Planar
            },
            segment_stretch_max: args.stretch,
            seed,
            searches: args.searches,
            library_candidates: 0,
            threads: args.threads,
            ..config.search
        };
        let request = PlanRequest {
            limits: limits.clone(),
            ..PlanRequest::new(config.goal(kind, target_m), &random_rope(seed), options)
        };
        let task = request.goal.task();
        let start = Instant::now();
        let planned = match planner::plan(&request, &mut |_| ControlFlow::Continue(())) {
            Ok(planned) => planned,
            Err(error) => {
                println!("rope {seed}: {error}");
                success.push(0.0);
                continue;
            }
        };
        seconds.push(start.elapsed().as_secs_f64());
        simulations.push(f64::from(planned.simulations));
        let ropes = Robustness::default().variants(&request.rope);
        let throws: Vec<_> = ropes.iter().map(|r| (r, &planned.trajectory)).collect();
        let simulator = ThrowSimulator {
            tail_s: task.config().observed_s,
            ..simulator_for(task, &request.rope, &request.cell, &request.options)
        };
        let outcomes = simulator.run(&throws).expect("a planned throw simulates");
        let squares: f64 = outcomes.iter().map(|o| task.error_m(o).powi(2)).sum();
        let good = ropes
            .iter()
            .zip(&outcomes)
            .filter(|(r, o)| task.judge(r, o).success);
        exact.push(planned.predicted_error_m * 100.0);
        off.push((squares / outcomes.len() as f64).sqrt() * 100.0);
        success.push(f64::from(u8::from(planned.verdict.success)));
        successes.push(good.count() as f64 / ropes.len() as f64);
    }
    line("error (cm)", &exact);
    line("error, rope off (cm)", &off);
    line("success", &success);
    line("success, rope off", &successes);
    line("seconds", &seconds);
    line("simulations", &simulations);
}
