//! Moving an arm so that its joints show how they follow.

use super::evidence::{Evidence, recorded};
use crate::cli::LatencyArgs;
use crate::command::area::require_clear_area;
use crate::command::explain::explain_stop;
use crate::config;
use crate::pipeline::{self, ArmAddress, RunFolder};
use crate::session::Session;
use anyhow::anyhow;
use arm_model::response::Excitation;
use arm_model::{JOINTS, JointTrajectory, Limits};
use cli_output::{Failure, OrInput, Outcome, Stage, watch_interrupts};
use planner::response::excitation::sweep;
use run_log::files;
use serde_json::{Value, json};
use shared_types::OperatingMode;
use std::net::IpAddr;
use std::time::Duration;

/// Part of the arm's speed limits used for the move to the pose.
const MOVE_SPEED: f64 = 0.1;
/// Rest before and after each sweep, so that every joint starts and ends at rest.
const REST: Duration = Duration::from_millis(600);

/// What a measurement would do.
struct Intent {
    limits: Limits,
    excitation: Excitation,
    /// Joints (1-based) and their motions.
    sweeps: Vec<(usize, JointTrajectory)>,
}

fn intent(args: &LatencyArgs) -> Outcome<Intent> {
    let limits = config::here::<Limits>(args.arm.limits.as_deref()).or_input()?;
    let mut excitation = match &args.excitation {
        Some(path) => files::read_excitation(path).or_input()?,
        None => Excitation::default(),
    };
    excitation.seed = args.seed.unwrap_or(excitation.seed);
    let sweeps = sweeps(args, &excitation, &limits)?;
    Ok(Intent {
        limits,
        excitation,
        sweeps,
    })
}

/// Checks the motions and connects to nothing.
pub(super) fn dry_run(args: &LatencyArgs, quiet: bool) -> Outcome<Value> {
    let sweeps = intent(args)?.sweeps;
    let moving_s: f64 = sweeps.iter().map(|(_, t)| t.duration_s()).sum();
    if !quiet {
        println!(
            "dry run: {} sweeps keep all limits and would move the arm for {moving_s:.0} s; nothing was connected",
            sweeps.len()
        );
    }
    Ok(json!({
        "ok": true, "command": "latency", "dry_run": true, "sweeps": sweeps.len(), "duration_s": moving_s,
    }))
}

/// Moves the arm and keeps what was recorded.
pub(super) fn measure(args: &LatencyArgs, quiet: bool) -> Outcome<Evidence> {
    let Some(address) = args.arm.address else {
        return Err(Failure::input(anyhow!("name the arm with --arm ADDR")));
    };
    let Intent {
        limits,
        excitation,
        sweeps,
    } = intent(args)?;
    require_clear_area(&args.arm, "MEASURE", quiet)?;
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(args.out.as_deref(), "latency")?;
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    if args.arm.dead_man {
        session.hold_dead_man(quiet).or_failed()?;
    }
    let result = stream(
        &mut session,
        &folder,
        args,
        address,
        &limits,
        &sweeps,
        quiet,
    );
    session.end(result.is_ok());
    let whole = session.finish_run_file();
    explain_stop(folder.path(), quiet);
    result.or_failed()?;
    whole.or_failed()?;
    Ok(Evidence {
        source: format!("arm {address}:{}", args.arm.ports.command_port),
        excitation: Some(excitation),
        ..recorded(folder.path()).or_failed()?
    })
}

/// The sweeps asked for, with their joints (1-based).
fn sweeps(
    args: &LatencyArgs,
    excitation: &Excitation,
    limits: &Limits,
) -> Outcome<Vec<(usize, JointTrajectory)>> {
    let joints: Vec<usize> = match args.joints.as_slice() {
        [] => (1..=JOINTS).collect(),
        named => named.iter().map(|j| usize::from(*j)).collect(),
    };
    let pole = config::cell().or_input()?.pole;
    joints
        .into_iter()
        .map(|joint| {
            let swept = sweep(excitation, limits, &pole, joint - 1).or_input()?;
            Ok((joint, swept))
        })
        .collect()
}

fn stream(
    session: &mut Session,
    folder: &RunFolder,
    args: &LatencyArgs,
    ip: IpAddr,
    limits: &Limits,
    sweeps: &[(usize, JointTrajectory)],
    quiet: bool,
) -> anyhow::Result<()> {
    let stage = Stage::begin("bring-up", quiet);
    let address = ArmAddress {
        ip,
        command: args.arm.ports.command_port,
        joints: args.arm.ports.report_port,
        status: [args.arm.ports.status_port; 2],
    };
    pipeline::start_recorder(session, folder, limits, None, None)?;
    let link = pipeline::start_controller(session, folder, limits, address)?;
    for warning in pipeline::acquire(session, &link)? {
        tracing::warn!("{warning}");
    }
    stage.say("moving to the pose");
    pipeline::arm_for(session, &link, OperatingMode::SetUp)?;
    if let Some((_, first)) = sweeps.first() {
        pipeline::move_to(session, &link, first.start(), MOVE_SPEED)?;
    }
    stage.done("arm stands in the pose of the sweeps");
    let stage = Stage::begin("sweep", quiet);
    for (place, (joint, sweep)) in sweeps.iter().enumerate() {
        stage.say(format!("joint {joint} ({} of {})", place + 1, sweeps.len()));
        session.idle(REST)?;
        pipeline::execute(&link, sweep)?.finish(session)?;
    }
    session.idle(REST)?;
    stage.done(&format!("{} joints swept", sweeps.len()));
    Ok(())
}
