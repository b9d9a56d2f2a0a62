//! `experiments NAME`: reproduces a result of the paper on simulated ropes.
//!
//! Trials are kept in a result file with their seed and version; an interrupted run
//! resumes from it.

mod checkpoint;
mod fidelity;
mod importance;
mod lob_drape;
mod ood;
mod picture;
mod pipeline;
mod robust;
mod sensitivity;
mod sensitivity_picture;
pub(crate) mod setup;
mod sysid;
mod wiggles;

use crate::args::ResultCommand;
use cli_output::Outcome;
use serde_json::Value;

/// Ropes of a result of identification.
const ROPES: u64 = 1000;

/// Makes a result. The value is what `--json` prints.
pub fn run(command: &ResultCommand, quiet: bool) -> Outcome<Option<Value>> {
    match command {
        ResultCommand::Sysid(args) => sysid::run(args, quiet),
        ResultCommand::MotionFidelity(args) => fidelity::run(args, quiet),
        ResultCommand::SysidOod(args) => ood::run(args, quiet),
        ResultCommand::WiggleAblation(args) => wiggles::run(args, quiet),
        ResultCommand::SimPipeline(args) => pipeline::run(args, quiet),
        ResultCommand::LobDrape(args) => lob_drape::run(args, quiet),
        ResultCommand::Robust(args) => robust::run(args, quiet),
        ResultCommand::ParameterImportance(args) => importance::run(args, quiet),
        ResultCommand::SensitivityMaps(args) => sensitivity::run(args, quiet),
    }
}
