//! `wag plan`: from a rope and a target to a checked plan.

use crate::cli::PlanArgs;
use crate::failure::{Failure, OrInput, Outcome};
use crate::files;
use crate::progress::Stage;
use crate::session::interrupted;
use anyhow::{Context, anyhow};
use planner::process::PlannerConfig;
use planner::tasks::{PlanError, StrikeOptions, StrikeRequest, plan_strike};
use serde_json::{Value, json};
use shared_types::ipc::message::Progress;
use shared_types::{JointTrajectory, Limits, Plan};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::Ordering;

const PLANNER: &str = include_str!("../../../configs/planner/planner.toml");

/// The planner's configuration: a file, or the built-in one.
pub fn planner_config(path: Option<&Path>) -> anyhow::Result<PlannerConfig> {
    match path {
        None => toml::from_str(PLANNER)
            .context("the built-in `configs/planner/planner.toml` is damaged"),
        Some(path) => toml::from_str(&files::read_text(path)?)
            .with_context(|| format!("planner file `{}`", path.display())),
    }
}

/// A task that cannot be planned.
pub fn not_there(task: &str) -> Failure {
    Failure::failed(anyhow!(
        "planning a {task} is not implemented in this version; `wag plan strike` is"
    ))
}

/// Writes a trajectory as joints at the limits' rate, its last row at rest.
pub fn write_trajectory_csv(
    path: &Path,
    trajectory: &JointTrajectory,
    limits: &Limits,
) -> anyhow::Result<()> {
    let period_s = limits.period_s();
    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a trajectory lasts at most ten minutes"
    )]
    let cycles = (trajectory.duration_s() / period_s).ceil() as u32;
    let rows = (0..=cycles).map(|i| {
        let t = f64::from(i) * period_s;
        (t, trajectory.state_at(t).q)
    });
    files::write_joints(path, rows)
}

/// Bad requests are the caller's; everything else is a failure of the work.
fn classify(error: PlanError) -> Failure {
    match &error {
        PlanError::TargetNotFinite { .. }
        | PlanError::Unreachable { .. }
        | PlanError::Rope(_)
        | PlanError::Option { .. } => Failure::input(error),
        _ => Failure::failed(error),
    }
}

/// One line about a plan.
pub fn describe(plan: &Plan) -> String {
    format!(
        "predicted error {:.2} cm at {:.2} s, {} simulations",
        100.0 * plan.predicted_error_m,
        plan.predicted_time_s,
        plan.simulations
    )
}

pub fn strike(args: &PlanArgs, quiet: bool) -> Outcome<Option<Value>> {
    let rope = files::read_rope(&args.rope).or_input()?;
    let limits = files::read_limits(args.limits.as_deref()).or_input()?;
    let config = planner_config(args.config.as_deref()).or_input()?;
    crate::session::watch_interrupts().or_failed()?;
    let stage = Stage::begin("plan", quiet);
    let request = StrikeRequest {
        rope,
        target_m: args.target.0,
        limits: limits.clone(),
        options: StrikeOptions {
            seed: args.seed,
            ..config.search
        },
        config: config.strike,
    };
    let plan = plan_strike(&request, &mut |p| {
        stage.progress(&Progress {
            done: u32::try_from(p.generation).unwrap_or(u32::MAX),
            total: u32::try_from(p.generations).unwrap_or(u32::MAX),
            value: 100.0 * p.error_m,
            label: "best cm".to_owned(),
        });
        if interrupted().load(Ordering::SeqCst) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    })
    .map_err(classify)?;
    stage.done(&describe(&plan));
    files::write_json(&args.out, &plan).or_failed()?;
    if let Some(path) = &args.csv {
        write_trajectory_csv(path, &plan.trajectory, &limits).or_failed()?;
    }
    if !quiet {
        println!("{} -> `{}`", describe(&plan), args.out.display());
    }
    Ok(Some(json!({
        "ok": true, "command": "plan strike", "out": args.out, "seed": args.seed,
        "target_m": args.target.0, "predicted_error_m": plan.predicted_error_m,
        "predicted_time_s": plan.predicted_time_s, "simulations": plan.simulations,
        "resampled": plan.resampled, "trajectory_sha256": plan.trajectory_sha256,
    })))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shipped_file_says_what_the_defaults_are() {
        assert_eq!(planner_config(None).unwrap(), PlannerConfig::default());
    }
}
