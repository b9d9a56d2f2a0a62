//! `wag throw`: execute a plan on an arm, once, open loop, with latencies.

use super::area::{asks, limits, reach_measured, require_clear_area, response_for_plans};
use super::dry_run;
use super::motion;
use super::on_arm::{AT_START, on_arm};
use super::plan_again::{LastThrow, check_thrown};
use crate::cli::{ArmArgs, ThrowArgs};
use crate::config;
use crate::pipeline::{ArmAddress, RunFolder};
use arm_model::{ArmResponse, JointTrajectory, Limits};
use cli_output::{OrInput, Outcome, Stage};
use planner::plan::warnings;
use run_log::Run;
use run_log::files::{self, read_plan};
use serde_json::{Value, json};
use session::Session;
use session::arm::{self, ArmLink};
use shared_types::{OperatingMode, Plan};
use std::path::Path;

/// Moves to a trajectory's start and streams it, armed for the throw of a `plan` or for a wiggle;
/// returns what was measured. Without an `address` it must be a dry run.
pub fn drive(
    arm: &ArmArgs,
    address: Option<ArmAddress>,
    limits: &Limits,
    trajectory: &JointTrajectory,
    out: Option<&Path>,
    // The throw's, which the run keeps.
    plan: Option<&Plan>,
) -> Outcome<Option<Value>> {
    let operating_mode = match plan {
        Some(_) => OperatingMode::Throw,
        None => OperatingMode::Wiggle,
    };
    let (name, word) = motion::words(operating_mode);
    motion::check(address.as_ref(), limits, trajectory, operating_mode)?;
    if arm.dry_run {
        out.map_or(Ok(()), RunFolder::refuse_existing)?;
        return dry_run::tell(arm, limits, trajectory, name).map(Some);
    }
    let Some(address) = address else {
        return Err(bad_input!(
            "name the arm with --arm ADDR, or a controller that runs with --controller NAME"
        ));
    };
    motion::require_measured_joints(&address, trajectory, operating_mode)?;
    require_clear_area(arm, &address, "MOVE")?;
    let start = trajectory.start();
    let is_asked = asks(arm, &address);
    let work = |session: &mut Session, link: &ArmLink| {
        let confirmed_ns = session.confirm_and_hold(is_asked.then_some((AT_START, word)))?;
        let stage = Stage::begin("stream");
        arm::latency(session, link)?;
        arm::arm_for(session, link, operating_mode, Some(confirmed_ns))?;
        let span = arm::execute(session, link, trajectory)?;
        let latency = arm::latency(session, link)?;
        stage.done(&format!(
            "{} cycles, {} missed, reply p99 {:.0} µs",
            latency.cycles, latency.missed, latency.reply.p99_us
        ));
        Ok(json!({
            "start_ns": span.start_ns, "end_ns": span.end_ns, "latency": latency,
        }))
    };
    let place = (out, name, plan);
    let (folder, value) = on_arm(arm, address, limits, start, place, work, |_, _, value| {
        Ok(value)
    })?;
    println!("done; run folder: {}", folder.display());
    Ok(Some(value))
}

pub fn run(args: &ThrowArgs) -> Outcome<Option<Value>> {
    let named = args.plan.as_deref().map(read_plan).transpose().or_input()?;
    let last = args.again.as_deref();
    let last = last
        .map(|run| LastThrow::read(run, args.miss))
        .transpose()?;
    for plan in named.iter().chain(last.as_ref().map(|last| &last.plan)) {
        check_thrown(plan, args.accept_unconfirmed)?;
    }
    args.out
        .as_deref()
        .map_or(Ok(()), RunFolder::refuse_existing)?;
    let address = reach_measured(&args.arm)?;
    if let (Some(last), Some(arm)) = (args.plan.as_ref().or(args.again.as_ref()), &address) {
        Run::check_arm_of_throw(last, arm.simulated).or_input()?;
    }
    let limits = limits(&args.arm, address.as_ref())?;
    let plan = match (named, &last) {
        (Some(plan), _) => plan,
        (None, Some(last)) => {
            let config = config::here(None).or_input()?;
            last.to_throw(
                (limits.clone(), config),
                response(&args.arm, address.as_ref())?,
            )?
        }
        (None, None) => return Err(bad_input!("name a plan, or a run with --again RUN")),
    };
    let run = drive(
        &args.arm,
        address,
        &limits,
        &plan.trajectory,
        args.out.as_deref(),
        Some(&plan),
    )?;
    Ok(Some(json!({
        "ok": true, "command": "throw", "plan": args.plan, "again": args.again,
        "miss_m": last.map(|last| last.miss_m), "aim": plan.aim, "forecast": plan.forecast,
        "warnings": warnings(&plan), "run": run,
    })))
}

/// How the arm follows, as far as that is known: what a correction is made with where the last
/// throw was.
fn response(arm: &ArmArgs, address: Option<&ArmAddress>) -> Outcome<Option<ArmResponse>> {
    match address {
        Some(address) => response_for_plans(address),
        None => {
            let mut places = config::arm_response_files().or_input()?;
            let here = places.find(|file| file.exists());
            let named = arm.arm_response.clone().or(here);
            named
                .map(|file| files::read_arm_response(&file))
                .transpose()
                .or_input()
        }
    }
}
