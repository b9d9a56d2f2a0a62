//! `experiments motion-fidelity`: ropes from outside the model class, identified from
//! one noisy wiggle, compared in a throw.

use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use anyhow::{Context, anyhow};
use arm_model::{JointTrajectory, Limits};
use cli_output::Stage;
use cli_output::interrupted;
use cli_output::table::numbers;
use cli_output::{Failure, OrInput, Outcome};
use experiments::trials::{FidelityConfig, FidelityRow, middle_rope};
use planner::process::PlannerConfig;
use planner::tasks::{Belief, PlanOptions, PlanRequest, plan_throw};
use run_log::files;
use serde_json::{Value, json};
use shared_types::Task;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

const ROPES: &str = include_str!("../../../configs/planner/fidelity.toml");
/// Where the compared throw would have to strike (m).
const TARGET_M: [f64; 3] = [1.0, 0.0, 0.4];

/// A throw planned for the middle of the ranges: no rope compared knows it.
fn throw(config: &PlannerConfig, seed: u64) -> anyhow::Result<JointTrajectory> {
    let request = PlanRequest {
        rope: middle_rope(),
        limits: Limits::default(),
        options: PlanOptions {
            seed,
            ..config.search
        },
        belief: Belief::default(),
        following: None,
    };
    let task = config.task(Task::Strike, TARGET_M);
    let plan = plan_throw(&*task, &request, &mut |_| ControlFlow::Continue(()))?;
    Ok(plan.trajectory)
}

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup {
        config,
        rig,
        options,
    } = Setup::new(args)?;
    let ropes = toml::from_str::<FidelityConfig>(ROPES)
        .context("the built-in `configs/planner/fidelity.toml` is damaged")
        .or_failed()?
        .ropes();
    let stage = Stage::begin("fidelity", quiet);
    let throw = throw(&config, args.seed).or_failed()?;
    let mut rows: Vec<FidelityRow> = Vec::new();
    for (index, rope) in (0_u64..).zip(&ropes) {
        if interrupted().load(Ordering::SeqCst) {
            return Err(Failure::failed(anyhow!("interrupted")));
        }
        let row = rig.fidelity(rope, &throw, args.seed, index, &options);
        rows.push(row.or_failed()?);
        stage.progress(&Progress {
            done: u32::try_from(rows.len()).unwrap_or(u32::MAX),
            total: u32::try_from(ropes.len()).unwrap_or(u32::MAX),
            value: rows.last().map_or(0.0, |r| 100.0 * r.distance_m),
            label: "ropes, cm per frame".to_owned(),
        });
    }
    let seconds = stage.done(&format!("{} ropes", rows.len()));
    #[allow(clippy::cast_precision_loss, reason = "ten ropes")]
    let mean =
        |of: fn(&FidelityRow) -> f64| rows.iter().map(of).sum::<f64>() / rows.len().max(1) as f64;
    let (correlation, distance_m) = (mean(|r| r.frequency_correlation), mean(|r| r.distance_m));
    let (random, random_m) = (
        mean(|r| r.random_correlation),
        mean(|r| r.random_distance_m),
    );
    let middle_m = mean(|r| r.middle_distance_m);
    if !quiet {
        print(&rows);
        println!(
            "\nmean: correlation {correlation:.4} (paper 0.95), {:.2} cm per frame (paper 5.4)\nfor scale: middle of the ranges {:.2} cm; random ropes of the ranges correlation {random:.4}, {:.2} cm",
            100.0 * distance_m,
            100.0 * middle_m,
            100.0 * random_m
        );
    }
    let curve = |name: &str, paper, of: fn(&FidelityRow) -> f64| Curve {
        name: name.to_owned(),
        values: rows.iter().map(|r| 100.0 * of(r)).collect(),
        paper,
    };
    let picture = Picture {
        name: "motion-fidelity",
        axis: "mean distance per frame (cm); dashed: the paper's",
        seed: args.seed,
        curves: vec![
            curve("identified", Some(5.4), |r| r.distance_m),
            curve("middle of the ranges", None, |r| r.middle_distance_m),
            curve("random ropes", None, |r| r.random_distance_m),
        ],
    };
    let picture = picture.write(args.out.as_deref())?;
    let value = json!({
        "ok": true, "command": "motion-fidelity", "version": shared_types::VERSION,
        "seed": args.seed, "method": options.method, "seconds": seconds,
        "frequency_correlation": correlation, "distance_m": distance_m,
        "middle_distance_m": middle_m, "random_correlation": random,
        "random_distance_m": random_m, "ropes": rows, "out": args.out, "picture": picture,
    });
    if let Some(path) = &args.out {
        files::write_json(path, &value).or_failed()?;
    }
    Ok(Some(value))
}

fn print(rows: &[FidelityRow]) {
    let lines = rows.iter().map(|row| {
        [
            row.name.clone(),
            format!("{:.4}", row.frequency_correlation),
            format!("{:.2}", 100.0 * row.distance_m),
            format!("{:.2}", 100.0 * row.middle_distance_m),
            format!("{:.2}", 100.0 * row.random_distance_m),
            format!("{:.2}", row.residual_px),
            row.method.clone(),
        ]
    });
    let header = [
        "rope, lead",
        "frequency correlation",
        "cm per frame",
        "middle of ranges (cm)",
        "random rope (cm)",
        "residual (px)",
        "method",
    ];
    println!("{}", numbers(header, 1, lines));
}
