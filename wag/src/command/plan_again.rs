//! `wag plan again`: the last strike, corrected by its miss.

use super::plan::{classify, describe, tell};
use crate::cli::AgainArgs;
use crate::config;
use anyhow::Context;
use arm_model::Limits;
use cli_output::{OrInput, Outcome, Stage};
use planner::PlannerConfig;
use planner::arm_response::Following;
use planner::plan::{PlanOptions, PlanRequest, PosteriorEnsemble, plan_again, warnings};
use run_log::files;
use serde_json::{Value, json};
use std::path::Path;

/// The miss that a run's camera measured (m).
fn measured(run: &Path) -> anyhow::Result<[f64; 3]> {
    let path = run.join(files::SUMMARY);
    let summary: Value = files::read_json(&path)?;
    let miss = serde_json::from_value(summary["score"]["miss_m"].clone());
    miss.with_context(|| {
        format!(
            "`{}` has no miss by the camera (`score.miss_m`): name it with --miss",
            path.display()
        )
    })
}

pub fn run(args: &AgainArgs) -> Outcome<Option<Value>> {
    let is_run = args.last.is_dir();
    let plan = is_run.then(|| args.last.join(files::PLAN));
    let last = files::read_plan(plan.as_ref().unwrap_or(&args.last)).or_input()?;
    let miss_m = match args.miss {
        Some(miss) => miss.0,
        None if is_run => measured(&args.last).or_input()?,
        None => {
            return Err(bad_input!(
                "where did the tip pass? Name it with --miss X,Y,Z, as `wag score` prints it"
            ));
        }
    };
    let limits = config::here::<Limits>(args.limits.as_deref()).or_input()?;
    let config: PlannerConfig = config::here(args.config.as_deref()).or_input()?;
    let response = args.arm_response.as_deref().map(files::read_arm_response);
    let response = response.transpose().or_input()?;
    let request = PlanRequest {
        goal: config.goal(last.task, last.target_m),
        rope: last.rope,
        cell: config::cell_for(&last).or_input()?,
        options: PlanOptions {
            seed: last.seed,
            ..config.search
        },
        ensemble: PosteriorEnsemble::default(),
        following: response.map(|r| Following::new(&r, &limits)),
        limits,
    };
    let stage = Stage::begin("plan");
    let plan = plan_again(&request, &last, miss_m).map_err(classify)?;
    stage.done(&describe(&plan));
    tell(&plan);
    files::write_json(&args.out, &plan).or_failed()?;
    println!("corrected plan written to `{}`", args.out.display());
    Ok(Some(json!({
        "ok": true, "command": "plan again", "out": args.out, "miss_m": miss_m,
        "target_m": plan.target_m, "aim": plan.aim, "warnings": warnings(&plan), "forecast": plan.forecast,
        "predicted_error_m": plan.predicted_error_m, "simulations": plan.simulations,
        "trajectory_sha256": plan.trajectory_sha256,
    })))
}
