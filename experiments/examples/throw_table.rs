//! Plans throws for random ropes and prints how well they do.
//!
//! `throw_table [--task strike|lob|drape] [--ropes 20] [--seed 900] [--searches 1]
//! [--config FILE] [--full 0] [--stretch 1] [--speed 1.2] [--verbose 1]`
//!
//! Errors are given for the rope planned for, as the root mean square over ropes off by
//! what identification leaves open, and as the part of those that succeeds.
#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::cast_precision_loss,
    reason = "an example may stop with a message"
)]

use arm_model::Limits;
use arm_model::limits::LimitsSpec;
use planner::process::PlannerConfig;
use planner::ropes::{random_rope, random_strike_target};
use planner::tasks::{
    Belief, PlanOptions, PlanRequest, Robustness, ThrowSimulator, plan_throw, simulator_for,
};
use planner::trajopt::Dimensions;
use shared_types::Task;
use std::ops::ControlFlow;
use std::time::Instant;

fn argument(name: &str) -> Option<String> {
    std::env::args()
        .skip_while(|a| a != &format!("--{name}"))
        .nth(1)
}

fn number<T: std::str::FromStr>(name: &str, default: T) -> T {
    argument(name).map_or(default, |v| {
        v.parse()
            .unwrap_or_else(|_| panic!("--{name} {v} is not a number"))
    })
}

fn line(name: &str, mut values: Vec<f64>) {
    values.sort_by(f64::total_cmp);
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an index"
    )]
    let at = |part: f64| values[((values.len() - 1) as f64 * part).round() as usize];
    println!(
        "{name:24} mean {:7.3}  median {:7.3}  p90 {:7.3}  max {:7.3}",
        values.iter().sum::<f64>() / values.len() as f64,
        at(0.5),
        at(0.9),
        at(1.0)
    );
}

fn main() {
    let config: PlannerConfig = argument("config").map_or_else(PlannerConfig::default, |path| {
        let text = std::fs::read_to_string(path).expect("--config names a file");
        toml::from_str(&text).expect("a planner file")
    });
    let kind = match argument("task").as_deref() {
        None | Some("strike") => Task::Strike,
        Some("lob") => Task::Lob,
        Some("drape") => Task::Drape,
        Some(other) => panic!("--task {other} is not one of strike, lob, drape"),
    };
    let mut spec = LimitsSpec::from(Limits::default());
    spec.tcp_speed_max_m_s = number("speed", spec.tcp_speed_max_m_s);
    let limits = Limits::try_from(spec).expect("a positive speed");
    let (mut exact, mut off, mut success, mut successes) = (vec![], vec![], vec![], vec![]);
    let (mut seconds, mut simulations) = (vec![], vec![]);
    for index in 0..number("ropes", 20) {
        let seed = index + number("seed", 900u64) * 1000;
        let target_m = match kind {
            Task::Strike => random_strike_target(seed),
            Task::Lob => [0.85, 0.0, 0.20],
            Task::Drape => [0.75, 0.0, 0.30],
        };
        let task = config.task(kind, target_m);
        let request = PlanRequest {
            rope: random_rope(seed),
            limits: limits.clone(),
            options: PlanOptions {
                dimensions: if number("full", 0) == 1 {
                    Dimensions::Full
                } else {
                    Dimensions::Planar
                },
                segment_stretch_max: number("stretch", 1.0),
                seed,
                searches: number("searches", 1),
                threads: number("threads", 2),
                ..config.search
            },
            belief: Belief::default(),
            following: None,
        };
        let start = Instant::now();
        let planned = match plan_throw(&*task, &request, &mut |_| ControlFlow::Continue(())) {
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
            ..simulator_for(&*task, &request.rope, &request.options)
        };
        let outcomes = simulator.run(&throws).expect("a planned throw simulates");
        let squares: f64 = outcomes.iter().map(|o| task.error_m(o).powi(2)).sum();
        let rms_cm = (squares / outcomes.len() as f64).sqrt() * 100.0;
        let good = ropes
            .iter()
            .zip(&outcomes)
            .filter(|(r, o)| task.judge(r, o).success);
        let part = good.count() as f64 / ropes.len() as f64;
        if argument("verbose").is_some() {
            let met: Vec<String> = planned
                .verdict
                .conditions
                .iter()
                .map(|c| format!("{} {}", c.name, c.met))
                .collect();
            println!(
                "rope {seed:3} L {:.2} k {:.2} mu {:.3} lead {:.3} error {:.2} cm, off {rms_cm:.2} cm, success {part:.2}, {:?}, {:?}, {met:?}",
                request.rope.length_m,
                request.rope.joint_stiffness_nm_per_rad,
                request.rope.mass_per_length_kg_per_m,
                request.rope.lead_mass_kg,
                planned.error_m * 100.0,
                planned.limited_by,
                planned.outcome.contacts,
            );
        }
        exact.push(planned.error_m * 100.0);
        off.push(rms_cm);
        success.push(f64::from(u8::from(planned.verdict.success)));
        successes.push(part);
    }
    line("error (cm)", exact);
    line("error, rope off (cm)", off);
    line("success", success);
    line("success, rope off", successes);
    line("seconds", seconds);
    line("simulations", simulations);
}
