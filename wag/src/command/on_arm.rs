//! Work on an arm from its bring-up to the end of its record: what throw, wiggle and
//! latency have in common.

use super::area::{asks, operator};
use super::runs::explain_stop;
use crate::cli::ArmArgs;
use crate::pipeline::{self, ArmAddress, RunFolder};
use arm_model::{JointVector, Limits};
use cli_output::{OrInput, Outcome, Stage, watch_interrupts};
use run_log::{Cycles, files};
use serde_json::{Value, json};
use session::arm::{self, ArmLink, BringUp};
use session::{Confirmation, Session, Switch};
use shared_types::{OperatingMode, Plan};
use std::path::{Path, PathBuf};

/// How the arm is when a motion is confirmed.
pub const AT_START: &str = "The arm stands at the start.";
/// Part of the arm's speed limits used for the move to the start pose.
pub const MOVE_SPEED: f64 = 0.1;

/// Moves the arm at `address` to `start` and lets `work` go on; a throw's plan is kept before. When the processes have ended, `conclude`
/// makes the run's summary from its folder, the received cycles and what `work` returned.
/// Returns the folder and the summary.
///
/// # Errors
/// What went wrong, which the run's summary says too.
pub fn on_arm(
    arm: &ArmArgs,
    address: ArmAddress,
    limits: &Limits,
    start: JointVector,
    (out, name, plan): (Option<&Path>, &str, Option<&Plan>),
    work: impl FnOnce(&mut Session, &ArmLink) -> anyhow::Result<Value>,
    conclude: impl FnOnce(&Path, Cycles, Value) -> anyhow::Result<Value>,
) -> Outcome<(PathBuf, Value)> {
    watch_interrupts().or_failed()?;
    let operator = operator(arm, &address)?;
    let mut folder = RunFolder::create(out, name)?;
    let kept = plan.map(|plan| files::write_json(&folder.file(files::PLAN), plan));
    kept.transpose().or_failed()?;
    if let Some(service) = &address.service {
        folder.domain.clone_from(&service.config.domain);
    }
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    watch_operator(&mut session, arm, &address).or_failed()?;
    let mut found = BringUp::default();
    let worked = |session: &mut Session| -> anyhow::Result<Value> {
        let link = bring_up(
            session,
            &folder,
            (&address, arm.acknowledge),
            limits,
            (start, plan.map(|plan| plan.target_m)),
            &mut found,
        )?;
        let mut value = work(session, &link)?;
        value["ok"] = true.into();
        value["run"] = json!(folder.path);
        value["warnings"] = json!(found.warnings);
        Ok(value)
    };
    let result = worked(&mut session);
    session.end(result.is_ok());
    let cycles = std::mem::take(&mut session.received.cycles);
    let epoch_ns = cycles.cycles.first().map_or(0, |c| c.deadline_ns);
    let by_service = address.service.is_some();
    let result = result.map_err(|error| session::of_service(by_service, error));
    let result = result.and_then(|value| conclude(folder.path.as_path(), cycles, value));
    let mut summary = match &result {
        Ok(value) => value.clone(),
        Err(e) => json!({ "ok": false, "error": format!("{e:#}") }),
    };
    summary["command"] = name.into();
    if let Some(plan) = plan {
        summary["task"] = json!(plan.task);
        summary["target_m"] = json!(plan.target_m);
    }
    summary["epoch_ns"] = epoch_ns.into();
    summary["operator"] = json!(operator);
    summary["confirmed"] = confirmations(&session).into();
    summary["bring_up"] = found.steps_json().into();
    let kept = files::write_json(&folder.file(files::SUMMARY), &summary);
    let recorded = session.finish_run_file();
    // A stop that was measured needs no explanation.
    if result.is_err() {
        explain_stop(&folder.path);
    }
    let value = result.or_failed()?;
    recorded.or_failed()?;
    kept.or_failed()?;
    Ok((folder.path.clone(), value))
}

/// Takes the operator's place at the controller of `address` and enables its arm; what was `found`
/// on the way, also when it is refused.
pub fn enable(
    session: &mut Session,
    link: &ArmLink,
    (address, acknowledges): (&ArmAddress, bool),
    found: &mut BringUp,
) -> anyhow::Result<()> {
    session.take_operator()?;
    if let Some(service) = &address.service {
        // What was asked, checked and confirmed was so for that configuration.
        service.require_unchanged(session, link)?;
    }
    arm::enable(session, link, acknowledges, found)?;
    for warning in &found.warnings {
        tracing::warn!("{warning}");
    }
    Ok(())
}

/// Moves at set-up speed, as fast as a part of the arm's fastest move.
pub fn set_up_move(
    session: &mut Session,
    link: &ArmLink,
    pose: JointVector,
    speed_fraction: f64,
) -> anyhow::Result<()> {
    session.await_hold()?;
    arm::arm_for(session, link, OperatingMode::SetUp, None)?;
    arm::move_to(session, link, pose, speed_fraction)?;
    Ok(())
}

/// Watches the operator at standard input, as the arm and the command line want it.
pub fn watch_operator(
    session: &mut Session,
    arm: &ArmArgs,
    address: &ArmAddress,
) -> anyhow::Result<()> {
    if arm.hold_to_run {
        session.watch_operator(Switch::HoldToRun)?;
    } else if arm.dead_man || asks(arm, address) {
        session.watch_operator(Switch::DeadMan)?;
    }
    if arm.ask && address.simulated {
        eprintln!(
            "A rehearsal: the simulated arm has no enabling switch, takes the settings that it is given, and is compared with a measured response only if --arm-response names one"
        );
    }
    Ok(())
}

/// What the operator confirmed, as a summary contains it.
pub fn confirmations(session: &Session) -> Vec<Value> {
    let confirmed = |c: &Confirmation| {
        let at = humantime::format_rfc3339_millis(c.at).to_string();
        json!({ "word": c.word, "at_ns": c.at_ns, "at": at })
    };
    session.confirmed.iter().map(confirmed).collect()
}

/// Starts everything and moves to the start pose; what was `found` on the way.
fn bring_up(
    session: &mut Session,
    folder: &RunFolder,
    (address, acknowledges): (&ArmAddress, bool),
    limits: &Limits,
    (start, target_m): (JointVector, Option<[f64; 3]>),
    found: &mut BringUp,
) -> anyhow::Result<ArmLink> {
    let stage = Stage::begin("bring-up");
    pipeline::start_recorder(session, folder, limits, None, target_m)?;
    let link = pipeline::controller(session, folder, limits, address)?;
    enable(session, &link, (address, acknowledges), found)?;
    stage.done("arm enabled");
    let stage = Stage::begin("start pose");
    set_up_move(session, &link, start, MOVE_SPEED)?;
    stage.done("arm stands at the start");
    Ok(link)
}
