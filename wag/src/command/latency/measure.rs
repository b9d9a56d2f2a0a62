//! Moving an arm so that its joints show how they follow.

use super::evidence::Evidence;
use crate::cli::LatencyArgs;
use crate::command::area::{asks, limits, reach, require_clear_area};
use crate::command::on_arm::{AT_START, on_arm};
use crate::config;
use crate::pipeline::ArmAddress;
use anyhow::Context;
use arm_model::response::Excitation;
use arm_model::{JOINTS, JointTrajectory, Limits};
use cli_output::{OrInput, Outcome, Stage};
use planner::arm_response::excitation::sweep;
use run_log::files;
use serde_json::{Value, json};
use session::arm;
use shared_types::OperatingMode;
use std::time::Duration;

/// Rest before and after each sweep, so that every joint starts and ends at rest.
const REST: Duration = Duration::from_millis(600);

/// Limits, the shape of the motion, and the sweeps asked for with their joints (1-based).
type Intent = (Limits, Excitation, Vec<(usize, JointTrajectory)>);

fn intent(args: &LatencyArgs, address: Option<&ArmAddress>) -> Outcome<Intent> {
    let limits = limits(&args.arm, address)?;
    let mut excitation = match &args.excitation {
        Some(path) => files::read_excitation(path).or_input()?,
        None => Excitation::default(),
    };
    excitation.seed = args.seed.unwrap_or(excitation.seed);
    let joints: Vec<usize> = match args.joints.as_slice() {
        [] => (1..=JOINTS).collect(),
        named => named.iter().map(|j| usize::from(*j)).collect(),
    };
    let pole = config::cell().or_input()?.pole;
    let named = args.excitation.as_deref().unwrap_or("built in".as_ref());
    let swept = |joint: usize| {
        let swept = sweep(&excitation, &limits, &pole, joint - 1)
            .with_context(|| format!("excitation `{}`", named.display()));
        Ok((joint, swept.or_input()?))
    };
    let sweeps = joints.into_iter().map(swept).collect::<Outcome<_>>()?;
    Ok((limits, excitation, sweeps))
}

/// Checks the motions and connects to nothing.
pub(super) fn dry_run(args: &LatencyArgs) -> Outcome<Value> {
    let (_, _, sweeps) = intent(args, None)?;
    let moving_s: f64 = sweeps.iter().map(|(_, t)| t.duration_s()).sum();
    let joints: Vec<String> = sweeps.iter().map(|(joint, _)| joint.to_string()).collect();
    println!(
        "dry run: sweeps of joints {} keep all limits and would move the arm for {moving_s:.0} s; nothing was connected",
        joints.join(", ")
    );
    Ok(json!({
        "ok": true, "command": "latency", "dry_run": true, "sweeps": sweeps.len(), "duration_s": moving_s,
    }))
}

/// Moves the arm; what `conclude` finds in what it did is the run's summary.
pub(super) fn measure(
    args: &LatencyArgs,
    conclude: impl FnOnce(&Evidence) -> anyhow::Result<Value>,
) -> Outcome<Value> {
    // Wrong input is refused before anything is connected; the limits of a running controller
    // are not known before.
    let local = args.arm.controller.is_none();
    let intended = local.then(|| intent(args, None)).transpose()?;
    let Some(address) = reach(&args.arm)? else {
        return Err(bad_input!("name the arm with --arm ADDR"));
    };
    let (limits, excitation, sweeps) = match intended {
        Some(intended) => intended,
        None => intent(args, Some(&address))?,
    };
    require_clear_area(&args.arm, &address, "MOVE")?;
    let is_asked = asks(&args.arm, &address);
    let Some((_, first)) = sweeps.first() else {
        return Err(bad_input!("name a joint with --joints"));
    };
    let place = (args.out.as_deref(), "latency", None);
    let source = format!("arm {}:{}", address.ip, address.command);
    let (_, found) = on_arm(
        &args.arm,
        address,
        &limits,
        first.start(),
        place,
        |session, link| {
            if is_asked {
                session.confirm(AT_START, "MEASURE")?;
                arm::arm_for(session, link, OperatingMode::SetUp, None)?;
            }
            session.await_hold()?;
            let stage = Stage::begin("sweep");
            for (place, (joint, sweep)) in sweeps.iter().enumerate() {
                stage.say(format!("joint {joint} ({} of {})", place + 1, sweeps.len()));
                session.idle(REST)?;
                arm::execute(session, link, sweep)?;
            }
            session.idle(REST)?;
            stage.done(&format!("{} joints swept", sweeps.len()));
            Ok(json!({}))
        },
        |folder, cycles, mut reported| {
            let mut found = conclude(&Evidence {
                excitation: Some(excitation),
                ..Evidence::of(source, folder, cycles)
            })?;
            found["warnings"] = reported["warnings"].take();
            Ok(found)
        },
    )?;
    Ok(found)
}
