//! Work on an arm from its bring-up to the end of its record: what throw, wiggle and
//! latency have in common.

use super::runs::explain_stop;
use crate::cli::ArmArgs;
use crate::pipeline::{self, ArmAddress, ArmLink, RunFolder};
use crate::session::Session;
use arm_model::{JointVector, Limits};
use cli_output::{OrInput, Outcome, Stage, watch_interrupts};
use run_log::{Cycles, files};
use serde_json::{Value, json};
use shared_types::OperatingMode;
use std::path::{Path, PathBuf};

/// Part of the arm's speed limits used for the move to the start pose.
const MOVE_SPEED: f64 = 0.1;

/// Moves the arm at `address` to `start` and lets `work` go on. When the processes have ended, `conclude`
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
    (out, name): (Option<&Path>, &str),
    work: impl FnOnce(&mut Session, &ArmLink) -> anyhow::Result<Value>,
    conclude: impl FnOnce(&Path, Cycles, Value) -> anyhow::Result<Value>,
) -> Outcome<(PathBuf, Value)> {
    watch_interrupts().or_failed()?;
    let folder = RunFolder::create(out, name)?;
    let mut session = Session::new(&folder.domain, &folder.log()).or_failed()?;
    if arm.dead_man {
        session.hold_dead_man().or_failed()?;
    }
    let worked = |session: &mut Session| -> anyhow::Result<Value> {
        let (link, warnings) = bring_up(session, &folder, address, limits, start)?;
        let mut value = work(session, &link)?;
        value["ok"] = true.into();
        value["run"] = json!(folder.path());
        value["warnings"] = json!(warnings);
        Ok(value)
    };
    let result = worked(&mut session);
    session.end(result.is_ok());
    let cycles = std::mem::take(&mut session.received.cycles);
    let epoch_ns = cycles.cycles.first().map_or(0, |c| c.deadline_ns);
    let result = result.and_then(|value| conclude(folder.path(), cycles, value));
    let mut summary = match &result {
        Ok(value) => value.clone(),
        Err(e) => json!({ "ok": false, "error": format!("{e:#}") }),
    };
    summary["epoch_ns"] = epoch_ns.into();
    let kept = files::write_json(&folder.file(files::SUMMARY), &summary);
    let recorded = session.finish_run_file();
    explain_stop(folder.path());
    let value = result.or_failed()?;
    recorded.or_failed()?;
    kept.or_failed()?;
    Ok((folder.path().to_owned(), value))
}

/// Starts everything and moves to the start pose; also returns what the real-time set-up
/// could not get.
fn bring_up(
    session: &mut Session,
    folder: &RunFolder,
    address: ArmAddress,
    limits: &Limits,
    start: JointVector,
) -> anyhow::Result<(ArmLink, Vec<String>)> {
    let stage = Stage::begin("bring-up");
    pipeline::start_recorder(session, folder, limits, None, None)?;
    let link = pipeline::start_controller(session, folder, limits, address)?;
    let warnings = pipeline::acquire(session, &link)?;
    for warning in &warnings {
        tracing::warn!("{warning}");
    }
    stage.say("moving to the start pose");
    pipeline::arm_for(session, &link, OperatingMode::SetUp)?;
    pipeline::move_to(session, &link, start, MOVE_SPEED)?;
    stage.done(if address.simulated {
        "arm stands at the start; simulated, so it is armed without asking"
    } else {
        "arm stands at the start"
    });
    Ok((link, warnings))
}
