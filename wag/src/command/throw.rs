//! `wag throw`: execute a plan on an arm, once, open loop, with latencies.

use super::check::read_plan;
use crate::cli::{ArmArgs, ThrowArgs};
use crate::failure::{Failure, OrInput, Outcome};
use crate::files;
use crate::pipeline::{self, RunFolder};
use crate::progress::Stage;
use crate::session::{Session, watch_interrupts};
use anyhow::anyhow;
use serde_json::{Value, json};
use shared_types::{JointTrajectory, Limits};
use std::path::Path;

/// Part of the arm's speed limits used for the move to the start pose.
const MOVE_SPEED: f64 = 0.1;

/// An arm that is not this machine moves only when somebody says the area is
/// clear.
pub fn require_confirmation(arm: &ArmArgs) -> Outcome {
    match arm.address {
        Some(address) if !address.is_loopback() && !arm.confirm && !arm.dry_run => {
            Err(Failure::input(anyhow!(
                "{address} is a real arm: clear the area, keep the emergency stop in reach, and add --confirm"
            )))
        }
        _ => Ok(()),
    }
}

/// Moves to a trajectory's start and streams it; returns what was measured.
pub fn drive(
    arm: &ArmArgs,
    limits: &Limits,
    trajectory: &JointTrajectory,
    out: Option<&Path>,
    name: &str,
    quiet: bool,
) -> Outcome<Option<Value>> {
    let Some(address) = arm.address else {
        return Err(Failure::input(anyhow!("name the arm with --arm ADDR")));
    };
    if let Some(worst) = limits.worst_violation(trajectory) {
        return Err(Failure::input(anyhow!(
            "the {name} breaks a limit: {}",
            worst.describe()
        )));
    }
    if arm.dry_run {
        if !quiet {
            println!(
                "dry run: the {name} keeps all limits and would run {:.2} s on {address}",
                trajectory.duration_s()
            );
        }
        return Ok(None);
    }
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(out, name)?;
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    let result = stream(&mut session, &folder, arm, limits, trajectory, quiet);
    session.end(result.is_ok());
    let epoch_ns = session.recorder.cycles.first().map_or(0, |c| c.deadline_ns);
    let kept = session.recorder.write(folder.path(), epoch_ns);
    let summary = match &result {
        Ok(value) => value.clone(),
        Err(e) => json!({ "ok": false, "error": format!("{e:#}") }),
    };
    files::write_json(&folder.file("summary.json"), &summary).or_failed()?;
    let value = result.or_failed()?;
    kept.or_failed()?;
    if !quiet {
        println!("done; run folder: {}", folder.path().display());
    }
    Ok(Some(value))
}

fn stream(
    session: &mut Session,
    folder: &RunFolder,
    arm: &ArmArgs,
    limits: &Limits,
    trajectory: &JointTrajectory,
    quiet: bool,
) -> anyhow::Result<Value> {
    let stage = Stage::begin("bring-up", quiet);
    let address = arm.address.ok_or_else(|| anyhow!("no arm named"))?;
    let ports = (arm.command_port, arm.report_port);
    let link = pipeline::start_controller_at(session, folder, limits, address, ports)?;
    let warnings = pipeline::acquire(session, &link)?;
    for warning in &warnings {
        tracing::warn!("{warning}");
    }
    stage.say("moving to the start pose");
    pipeline::move_to(session, &link, trajectory.start(), MOVE_SPEED)?;
    stage.done("arm stands at the start");
    let stage = Stage::begin("stream", quiet);
    pipeline::latency(session, &link)?;
    let span = pipeline::execute(&link, trajectory)?.finish(session)?;
    let latency = pipeline::latency(session, &link)?;
    stage.done(&format!(
        "{} cycles, {} missed, reply p99 {:.0} µs",
        latency.cycles, latency.missed, latency.reply.p99_us
    ));
    Ok(json!({
        "ok": true, "run": folder.path(), "start_ns": span.start_ns, "end_ns": span.end_ns,
        "latency": latency, "warnings": warnings,
    }))
}

pub fn run(args: &ThrowArgs, quiet: bool) -> Outcome<Option<Value>> {
    let plan = read_plan(&args.plan).or_input()?;
    require_confirmation(&args.arm)?;
    let limits = files::read_limits(args.arm.limits.as_deref()).or_input()?;
    let run = drive(
        &args.arm,
        &limits,
        &plan.trajectory,
        args.out.as_deref(),
        "throw",
        quiet,
    )?;
    Ok(Some(
        json!({ "ok": true, "command": "throw", "plan": args.plan, "run": run }),
    ))
}
