//! `wag plan again`: the last strike, corrected by its miss.

use super::plan::{check_fault, classify, describe, read, tell};
use crate::cli::AgainArgs;
use crate::config;
use cli_output::{OrInput, Outcome, Stage};
use planner::plan::{PlanOptions, PlanRequest, PosteriorEnsemble, plan_again, warnings};
use run_log::{Run, files};
use serde_json::{Value, json};

pub fn run(args: &AgainArgs) -> Outcome<Option<Value>> {
    let run = args.last.is_dir().then(|| Run::open(&args.last));
    let run = run.transpose().or_input()?;
    let in_run = run.as_ref().map(|run| run.folder().join(files::PLAN));
    let last = files::read_plan(in_run.as_ref().unwrap_or(&args.last)).or_input()?;
    let miss_m = match (args.miss, &run) {
        (Some(miss), _) => miss.0,
        (None, Some(run)) => run.miss_m().or_input()?,
        (None, None) => {
            return Err(bad_input!(
                "where did the tip pass? Name it with --miss X,Y,Z, as `wag score` prints it"
            ));
        }
    };
    let (limits, config, following) = read(&args.planner).or_input()?;
    let request = PlanRequest {
        goal: config.goal(last.task, last.target_m),
        rope: last.rope,
        cell: run
            .map_or_else(|| config::cell_for(&last), |run| config::cell_of(&run))
            .or_input()?,
        options: PlanOptions {
            seed: last.seed,
            ..config.search
        },
        ensemble: PosteriorEnsemble::default(),
        following,
        limits,
    };
    let stage = Stage::begin("plan");
    let plan = plan_again(&request, &last, miss_m).map_err(classify)?;
    stage.done(&describe(&plan));
    check_fault(&plan, args.allow_miss, &args.out).or_failed()?;
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
