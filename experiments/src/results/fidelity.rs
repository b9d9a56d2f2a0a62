//! `experiments motion-fidelity`: ropes from outside the model class, identified from
//! one noisy wiggle, compared in a throw.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use anyhow::{Context, anyhow};
use arm_model::JointTrajectory;
use cli_output::table::numbers;
use cli_output::{Failure, OrInput, Outcome, interrupted};
use experiments::trials::{FidelityConfig, FidelityRow, mean, middle_rope};
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest};
use run_log::files;
use serde_json::{Value, json};
use shared_types::Task;
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;

const ROPES: &str = include_str!("../../../configs/planner/fidelity.toml");
/// Where the compared throw would have to strike (m).
const TARGET_M: [f64; 3] = [1.0, 0.0, 0.4];

/// A throw planned for the middle of the ranges: it favours none of the compared ropes.
fn throw(config: &PlannerConfig, seed: u64) -> anyhow::Result<JointTrajectory> {
    let options = PlanOptions {
        seed,
        ..config.search
    };
    let request = PlanRequest::new(config.goal(Task::Strike, TARGET_M), &middle_rope(), options);
    let plan = planner::plan(&request, &mut |_| ControlFlow::Continue(()))?;
    Ok(plan.trajectory)
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let Experiment {
        args,
        config,
        rig,
        options,
        ..
    } = &experiment;
    let ropes = toml::from_str::<FidelityConfig>(ROPES)
        .context("the built-in `configs/planner/fidelity.toml` is damaged")
        .or_failed()?
        .ropes();
    let throw = throw(config, args.seed).or_failed()?;
    let mut rows: Vec<FidelityRow> = Vec::new();
    for (index, rope) in (0_u64..).zip(&ropes) {
        if interrupted().load(Ordering::SeqCst) {
            return Err(Failure::failed(anyhow!("interrupted")));
        }
        let row = rig.fidelity(rope, &throw, args.seed, index, options);
        let row = row.with_context(|| rope.name.clone()).or_failed()?;
        let value_cm = 100.0 * row.distance_m;
        rows.push(row);
        experiment.progress(rows.len(), ropes.len(), value_cm, "ropes, cm per frame");
    }
    let mean = |of: fn(&FidelityRow) -> f64| mean(rows.iter().map(of));
    let own = json!({
        "frequency_correlation": mean(|r| r.frequency_correlation),
        "distance_m": mean(|r| r.distance_m),
        "middle_distance_m": mean(|r| r.middle_distance_m),
        "random_correlation": mean(|r| r.random_correlation),
        "random_distance_m": mean(|r| r.random_distance_m), "ropes": rows,
    });
    let curve = |name: &str, paper, of: fn(&FidelityRow) -> f64| {
        Curve::cm(name, rows.iter().map(of), paper)
    };
    let curves = vec![
        curve("identified", Some(5.4), |r| r.distance_m),
        curve("middle of the ranges", None, |r| r.middle_distance_m),
        curve("random ropes", None, |r| r.random_distance_m),
    ];
    let axis = "mean distance per frame (cm); dashed: the paper's";
    let picture = experiment.picture(axis, curves)?;
    let out = args.out.as_ref();
    let summary = format!("{} ropes", rows.len());
    let value = experiment.finish(&summary, picture, own, || {
        print(&rows);
        println!(
            "\nmean: correlation {:.4} (paper 0.95), {} cm per frame (paper 5.4)\nfor scale: middle of the ranges {} cm; random ropes of the ranges correlation {:.4}, {} cm",
            mean(|r| r.frequency_correlation),
            cm(mean(|r| r.distance_m)),
            cm(mean(|r| r.middle_distance_m)),
            mean(|r| r.random_correlation),
            cm(mean(|r| r.random_distance_m))
        );
    })?;
    if let Some(path) = out {
        files::write_json(path, &value).or_failed()?;
    }
    Ok(value)
}

fn print(rows: &[FidelityRow]) {
    let lines = rows.iter().map(|row| {
        [
            row.name.clone(),
            format!("{:.4}", row.frequency_correlation),
            cm(row.distance_m),
            cm(row.middle_distance_m),
            cm(row.random_distance_m),
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
