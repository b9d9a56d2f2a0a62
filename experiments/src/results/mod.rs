//! `experiments NAME`: reproduces a result of the paper on simulated ropes.
//!
//! Trials are kept in a result file with their seed and version; an interrupted run
//! resumes from it.

mod ablated_wiggles;
mod checkpoint;
mod contact_dynamics;
pub(crate) mod experiment;
mod fidelity;
mod importance;
mod lob_drape;
mod ood;
mod other_reality;
mod picture;
mod pipeline;
mod real_dlo;
mod robust;
mod rope_accuracy;
mod sensitivity;
mod sensitivity_map;
mod sensitivity_picture;
mod spectra;
mod strikes;
mod sysid;
mod wiggles;

pub use checkpoint::{is_finished, merge as join};

use crate::args::{MergeArgs, ResultArgs, ResultCommand};
use cli_output::{OrInput, Outcome};
use experiment::Experiment;
use serde_json::{Value, json};

type Study = fn(Experiment<'_>) -> Outcome<Option<Value>>;

/// Makes a result. The value is what `--json` prints.
pub fn run(command: &ResultCommand) -> Outcome<Option<Value>> {
    let (name, args, study): (_, &ResultArgs, Study) = match command {
        ResultCommand::OtherReality(args) => return other_reality::run(args),
        ResultCommand::FullPipeline(args) => return other_reality::run_full(args),
        ResultCommand::RealDlo(args) => return real_dlo::run(args),
        ResultCommand::ContactDynamics(args) => return contact_dynamics::run(args),
        ResultCommand::RopeAccuracy(args) => return rope_accuracy::run(args),
        ResultCommand::Sysid(args) => ("sysid", args, sysid::run),
        ResultCommand::MotionFidelity(args) => ("motion-fidelity", args, fidelity::run),
        ResultCommand::SysidOod(args) => ("sysid-ood", args, ood::run),
        ResultCommand::WiggleAblation(args) => ("wiggle-ablation", args, wiggles::run),
        ResultCommand::SimPipeline(args) => ("sim-pipeline", args, pipeline::run),
        ResultCommand::LobDrape(args) => ("lob-drape", args, lob_drape::run),
        ResultCommand::Robust(args) => ("robust", args, robust::run),
        ResultCommand::ParameterImportance(args) => ("parameter-importance", args, importance::run),
        ResultCommand::SensitivityMaps(args) => ("sensitivity-maps", args, sensitivity::run),
    };
    study(Experiment::begin(name, args)?)
}

/// Joins the shards of a study.
pub fn merge(args: &MergeArgs) -> Outcome<Option<Value>> {
    let count = join(&args.shards, &args.out).or_input()?;
    println!(
        "{count} trials in `{}`; the study's own command with --out prints their result",
        args.out.display()
    );
    Ok(Some(json!({
        "ok": true, "command": "merge", "trials": count, "shards": args.shards.len(),
        "out": args.out,
    })))
}
