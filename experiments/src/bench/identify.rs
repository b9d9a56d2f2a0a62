//! `experiments bench identify`: time to identify one rope, by method, on all cores.

use super::spent::least;
use crate::args::BenchArgs;
use crate::network::{network, with_network};
use crate::report::{Column, print_table, report, verdict};
use cli_output::{Machine, OrInput, Outcome, Stage};
use experiments::trials::TrialRig;
use planner::identify::{IdentifyOptions, Method};
use planner::ropes::trial_rope;
use planner::synthetic::SyntheticFilm;
use serde::Serialize;
use serde_json::{Value, json};

/// One method's cost per rope, film making left out.
#[derive(Debug, Serialize)]
struct Row {
    method: &'static str,
    ropes: u64,
    /// Mean over the ropes of the least time of several runs (s).
    wall_s: f64,
    cpu_s: f64,
    /// Mean number of ropes simulated.
    simulations: f64,
    limit_wall_s: f64,
    within_limit: bool,
}

const TABLE: [Column<Row>; 5] = [
    ("method", |row| row.method.to_owned()),
    ("wall (s)", |row| format!("{:.4}", row.wall_s)),
    ("processor (s)", |row| format!("{:.4}", row.cpu_s)),
    ("simulations", |row| format!("{:.0}", row.simulations)),
    ("limit", |row| verdict(row.limit_wall_s, row.within_limit)),
];

fn measure(
    rig: &TrialRig,
    args: &BenchArgs,
    (method, limit_wall_s): (&'static str, f64),
    mut identify: impl FnMut(&SyntheticFilm, u64) -> Outcome<f64>,
) -> Outcome<Row> {
    // Ropes and runs of each.
    let (ropes, repeats) = if args.quick { (1, 1) } else { (5, 3) };
    let (mut wall_s, mut cpu_s, mut simulations) = (0.0, 0.0, 0.0);
    for index in 0..ropes {
        let rope = trial_rope(args.seed, index);
        let filmed = rig.film(&rope, args.seed, index).or_failed()?;
        let (spent, simulated) = least(repeats, || identify(&filmed, index))?;
        wall_s += spent.wall_s;
        cpu_s += spent.cpu_s;
        simulations += simulated;
    }
    let count = ropes as f64;
    Ok(Row {
        method,
        ropes,
        wall_s: wall_s / count,
        cpu_s: cpu_s / count,
        simulations: simulations / count,
        limit_wall_s,
        within_limit: wall_s / count < limit_wall_s,
    })
}

pub fn run(args: &BenchArgs) -> Outcome<Option<Value>> {
    let config = crate::results::experiment::built_in().or_failed()?;
    let mut rig = TrialRig::new(&config.wiggle).or_failed()?;
    with_network(&mut rig, Method::Hybrid, None)?;
    let options = IdentifyOptions {
        seed: args.seed,
        threads: Machine::here().cores,
        ..config.identify
    };
    let stage = Stage::begin("identify");
    let net = network(None)?;
    let nn = measure(&rig, args, ("nn", 0.010), |filmed, _| {
        // From keypoints to parameters; nothing is simulated.
        net.look(&rig.observation(filmed)).or_failed()?;
        Ok(0.0)
    })?;
    stage.say("network measured");
    let fit = |options: IdentifyOptions| {
        let rig = &rig;
        move |filmed: &SyntheticFilm, index: u64| {
            let found = rig.fit(filmed, index, &options).or_failed()?;
            Ok(f64::from(found.simulations))
        }
    };
    let hybrid = measure(&rig, args, ("hybrid", 2.0), fit(options))?;
    stage.say("hybrid measured");
    // Without its early stop and repeats: all the simulations of the paper.
    let whole = IdentifyOptions {
        method: Method::Cmaes,
        early_stop: false,
        repeats_max: 0,
        ..options
    };
    let cmaes = measure(&rig, args, ("cmaes", 6.0), fit(whole))?;
    stage.done("3 methods measured");
    let rows = [nn, hybrid, cmaes];
    let own = json!({ "methods": rows });
    Ok(report(args, "bench identify", own, || {
        println!("seed {}", args.seed);
        print_table(&rows, 1, TABLE);
    }))
}
