//! `wag throw`: execute a plan on an arm, once, open loop, with latencies.

use super::area::require_clear_area;
use super::dry_run;
use super::explain::explain_stop;
use crate::cli::{ArmArgs, ThrowArgs};
use crate::config;
use crate::pipeline::{self, ArmAddress, RunFolder};
use crate::session::Session;
use anyhow::anyhow;
use arm_model::{JointTrajectory, Limits};
use cli_output::{Failure, OrInput, Outcome, Stage, watch_interrupts};
use run_log::files::{self, read_plan};
use serde_json::{Value, json};
use shared_types::OperatingMode;
use std::path::Path;

/// Part of the arm's speed limits used for the move to the start pose.
const MOVE_SPEED: f64 = 0.1;

/// Moves to a trajectory's start and streams it, armed for `operating_mode`; returns what was
/// measured.
pub fn drive(
    arm: &ArmArgs,
    limits: &Limits,
    trajectory: &JointTrajectory,
    out: Option<&Path>,
    operating_mode: OperatingMode,
    quiet: bool,
) -> Outcome<Option<Value>> {
    let name = match operating_mode {
        OperatingMode::Throw => "throw",
        OperatingMode::Wiggle | OperatingMode::SetUp => "wiggle",
    };
    if let Some(worst) = limits.worst_violation(trajectory) {
        return Err(Failure::input(anyhow!(
            "the {name} breaks a limit: {}",
            worst.describe()
        )));
    }
    if arm.dry_run {
        return dry_run::tell(arm, limits, trajectory, name, quiet).map(Some);
    }
    if arm.address.is_none() {
        return Err(Failure::input(anyhow!("name the arm with --arm ADDR")));
    }
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(out, name)?;
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    if arm.dead_man {
        session.hold_dead_man(quiet).or_failed()?;
    }
    let result = stream(
        &mut session,
        &folder,
        arm,
        limits,
        trajectory,
        operating_mode,
        quiet,
    );
    session.end(result.is_ok());
    let mut summary = match &result {
        Ok(value) => value.clone(),
        Err(e) => json!({ "ok": false, "error": format!("{e:#}") }),
    };
    let first = session.received.cycles.cycles.first();
    summary["epoch_ns"] = json!(first.map_or(0, |c| c.deadline_ns));
    files::write_json(&folder.file(files::SUMMARY), &summary).or_failed()?;
    let recorded = session.finish_run_file();
    explain_stop(folder.path(), quiet);
    let value = result.or_failed()?;
    recorded.or_failed()?;
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
    operating_mode: OperatingMode,
    quiet: bool,
) -> anyhow::Result<Value> {
    let stage = Stage::begin("bring-up", quiet);
    let address = arm.address.ok_or_else(|| anyhow!("no arm named"))?;
    let address = ArmAddress {
        ip: address,
        command: arm.ports.command_port,
        joints: arm.ports.report_port,
        status: [arm.ports.status_port; 2],
    };
    pipeline::start_recorder(session, folder, limits, None, None)?;
    let link = pipeline::start_controller(session, folder, limits, address)?;
    let warnings = pipeline::acquire(session, &link)?;
    for warning in &warnings {
        tracing::warn!("{warning}");
    }
    stage.say("moving to the start pose");
    pipeline::arm_for(session, &link, OperatingMode::SetUp)?;
    pipeline::move_to(session, &link, trajectory.start(), MOVE_SPEED)?;
    stage.done(if address.ip.is_loopback() {
        "arm stands at the start; simulated, so it is armed without asking"
    } else {
        "arm stands at the start"
    });
    let stage = Stage::begin("stream", quiet);
    pipeline::latency(session, &link)?;
    pipeline::arm_for(session, &link, operating_mode)?;
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
    require_clear_area(&args.arm, "THROW", quiet)?;
    let limits = config::here::<Limits>(args.arm.limits.as_deref()).or_input()?;
    let run = drive(
        &args.arm,
        &limits,
        &plan.trajectory,
        args.out.as_deref(),
        OperatingMode::Throw,
        quiet,
    )?;
    Ok(Some(
        json!({ "ok": true, "command": "throw", "plan": args.plan, "run": run }),
    ))
}
