//! `wag plan`: from a rope and a target to a checked plan.

use super::known_rope::KnownRope;
use crate::cli::{PlanArgs, PlannerArgs};
use crate::config;
use anyhow::bail;
use arm_model::Limits;
use cli_output::{Failure, OrInput, Outcome, Stage, output};
use planner::PlannerConfig;
use planner::arm_response::Following;
use planner::plan::{
    PlanError, PlanOptions, PlanRequest, ReachMap, Shortcoming, clear_of_arm, shortcoming, warnings,
};
use run_log::{confirm, files};
use serde_json::{Value, json};
use shared_types::{Plan, RopeParams, Task};
use std::path::Path;

/// Bad requests are the caller's; everything else is a failure of the work.
pub fn classify(error: PlanError) -> Failure {
    Failure::of(error.is_input(), error)
}

/// Refuses a plan that would not do what it is for, unless that is wanted.
pub fn check_fault(plan: &Plan, allow_miss: bool, out: &Path) -> anyhow::Result<()> {
    match shortcoming(plan) {
        Some(Shortcoming { message, is_severe }) if is_severe && !allow_miss => bail!(
            "{message}; `{}` is not written, --allow-miss would write it",
            out.display()
        ),
        _ => Ok(()),
    }
}

/// How the track behind an identified rope can be looked at.
pub const LOOK: &str =
    "look at an overlay of the film that it was identified from (`wag track --overlay`)";

/// What a plan is made with: limits, the planner's values, how the arm follows.
pub fn read(args: &PlannerArgs) -> anyhow::Result<(Limits, PlannerConfig, Option<Following>)> {
    let limits = config::here(args.limits.as_deref())?;
    let config = config::here(args.config.as_deref())?;
    let response = args.arm_response.as_deref().map(files::read_arm_response);
    let following = response.transpose()?.map(|r| Following::new(&r, &limits));
    Ok((limits, config, following))
}

/// Draws which targets the rope reaches; refuses one that it does not.
fn reach(
    path: &Path,
    args: &PlanArgs,
    rope: &RopeParams,
    (limits, config): (&Limits, &PlannerConfig),
) -> Outcome<()> {
    /// The reach is explored before anything else is done.
    const THREADS: usize = 2;
    let stage = Stage::begin("reach");
    let map = ReachMap::explore(
        rope,
        limits,
        &config.cell,
        &config.strike,
        args.seed,
        THREADS,
    )
    .map_err(classify)?;
    let picture = planner::plan::reach_svg(&map, rope, args.target.0, args.seed);
    files::write_atomic(path, picture.as_bytes()).or_failed()?;
    stage.done(&format!(
        "{} throws, drawn in `{}`",
        map.throws,
        path.display()
    ));
    map.check(args.target.0).map_err(classify)
}

/// One line about a plan.
pub fn describe(plan: &Plan) -> String {
    format!(
        "residual in simulation {:.2} cm at {:.2} s, {} simulations",
        100.0 * plan.predicted_error_m,
        plan.predicted_time_s,
        plan.simulations
    )
}

/// Warnings and forecast.
pub fn tell(plan: &Plan) {
    for warning in warnings(plan) {
        output::remark(format_args!("warning: {warning}"));
    }
    if let Some(f) = plan.forecast {
        let [low, high] = f.interval_90_m.map(|m| 100.0 * m);
        let median = 100.0 * f.median_m;
        println!(
            "forecast: error {median:.2} cm in the median, {low:.2} to {high:.2} cm in nine of ten"
        );
    }
}

pub fn run(kind: Task, args: &PlanArgs) -> Outcome<Option<Value>> {
    let known = KnownRope::read(&args.rope).or_input()?;
    confirm(&known.unconfirmed, args.accept_unconfirmed, LOOK).or_failed()?;
    let (limits, config, following) = read(&args.planner).or_input()?;
    let ensemble = known.ensemble(args.robust, args.seed).or_input()?;
    if let Some(path) = &args.reach {
        clear_of_arm(args.target.0, &config.cell).map_err(classify)?;
        reach(path, args, &known.params, (&limits, &config))?;
    }
    cli_output::watch_interrupts().or_failed()?;
    let stage = Stage::begin("plan");
    let request = PlanRequest {
        limits: limits.clone(),
        cell: config.cell,
        ensemble,
        following,
        ..PlanRequest::new(
            config.goal(kind, args.target.0),
            &known.params,
            PlanOptions {
                seed: args.seed,
                segment_stretch_max: args
                    .segment_stretch
                    .unwrap_or(config.search.segment_stretch_max),
                ..config.search
            },
        )
    };
    let mut plan = planner::plan(&request, &mut |p| stage.go_on(&p)).map_err(classify)?;
    plan.unconfirmed = known.unconfirmed;
    let warnings = warnings(&plan);
    check_fault(&plan, args.allow_miss, &args.out).or_failed()?;
    stage.done(&describe(&plan));
    files::write_json(&args.out, &plan).or_failed()?;
    if let Some(path) = &args.csv {
        files::write_trajectory(path, &plan.trajectory, limits.period_s()).or_failed()?;
    }
    tell(&plan);
    println!("plan written to `{}`", args.out.display());
    Ok(Some(json!({
        "ok": true, "command": format!("plan {}", kind.name()), "out": args.out, "seed": args.seed,
        "warnings": warnings, "target_m": args.target.0, "predicted_error_m": plan.predicted_error_m,
        "predicted_time_s": plan.predicted_time_s, "simulations": plan.simulations,
        "resampled": plan.resampled, "interrupted": plan.interrupted, "limited_by": plan.limited_by,
        "arm_response": plan.arm_response, "reach": args.reach, "verdict": plan.verdict, "forecast": plan.forecast,
        "trajectory_sha256": plan.trajectory_sha256,
    })))
}
