//! `wag throw`: execute a plan on an arm, once, open loop, with latencies.

use super::area::require_clear_area;
use super::dry_run;
use super::on_arm::on_arm;
use super::plan::LOOK;
use super::unconfirmed::confirm;
use crate::cli::{ArmArgs, ThrowArgs};
use crate::config;
use crate::pipeline::{self, ArmAddress, ArmLink};
use crate::session::Session;
use arm_model::{JointTrajectory, Limits};
use cli_output::{OrInput, Outcome, Stage};
use run_log::files::read_plan;
use serde_json::{Value, json};
use shared_types::OperatingMode;
use std::path::Path;

/// Moves to a trajectory's start and streams it, armed for `operating_mode`; returns what was
/// measured. Without an `address` it must be a dry run.
pub fn drive(
    arm: &ArmArgs,
    address: Option<ArmAddress>,
    limits: &Limits,
    trajectory: &JointTrajectory,
    out: Option<&Path>,
    operating_mode: OperatingMode,
) -> Outcome<Option<Value>> {
    let name = match operating_mode {
        OperatingMode::Throw => "throw",
        OperatingMode::Wiggle | OperatingMode::SetUp => "wiggle",
    };
    if let Some(worst) = limits.worst_violation(trajectory) {
        return Err(bad_input!(
            "the {name} breaks a limit: {}",
            worst.describe()
        ));
    }
    if arm.dry_run {
        return dry_run::tell(arm, limits, trajectory, name).map(Some);
    }
    let Some(address) = address else {
        return Err(bad_input!("name the arm with --arm ADDR"));
    };
    let start = trajectory.start();
    let work = |session: &mut Session, link: &ArmLink| {
        let stage = Stage::begin("stream");
        pipeline::latency(session, link)?;
        pipeline::arm_for(session, link, operating_mode)?;
        let span = pipeline::execute(session, link, trajectory)?;
        let latency = pipeline::latency(session, link)?;
        stage.done(&format!(
            "{} cycles, {} missed, reply p99 {:.0} µs",
            latency.cycles, latency.missed, latency.reply.p99_us
        ));
        Ok(json!({ "start_ns": span.start_ns, "end_ns": span.end_ns, "latency": latency }))
    };
    let place = (out, name);
    let (folder, value) = on_arm(arm, address, limits, start, place, work, |_, _, value| {
        Ok(value)
    })?;
    println!("done; run folder: {}", folder.display());
    Ok(Some(value))
}

pub fn run(args: &ThrowArgs) -> Outcome<Option<Value>> {
    let plan = read_plan(&args.plan).or_input()?;
    confirm(&plan.doubts, args.accept_unconfirmed, LOOK).or_failed()?;
    config::cell_for(&plan).or_input()?;
    let address = require_clear_area(&args.arm, "THROW")?;
    let limits = config::here::<Limits>(args.arm.limits.as_deref()).or_input()?;
    let run = drive(
        &args.arm,
        address,
        &limits,
        &plan.trajectory,
        args.out.as_deref(),
        OperatingMode::Throw,
    )?;
    Ok(Some(
        json!({ "ok": true, "command": "throw", "plan": args.plan, "run": run }),
    ))
}
