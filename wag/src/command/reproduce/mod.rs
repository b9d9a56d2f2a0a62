//! `wag reproduce NAME`: a result of the paper again, on simulated ropes.
//!
//! Trials are kept in a result file with their seed and version; a run that was broken
//! off goes on from it.

mod fidelity;
mod importance;
mod kept;
mod lob_drape;
mod ood;
mod picture;
mod pipeline;
mod robust;
mod sensitivity;
mod sensitivity_picture;
mod setup;
mod sysid;
mod wiggles;

use crate::cli::{ReproduceArgs, ReproduceName};
use cli_output::Outcome;
use serde_json::Value;

/// Ropes of a result of identification.
const ROPES: u64 = 1000;

/// Makes a result. The value is what `--json` prints.
pub fn run(args: &ReproduceArgs, quiet: bool) -> Outcome<Option<Value>> {
    match args.name {
        ReproduceName::Sysid => sysid::run(args, quiet),
        ReproduceName::MotionFidelity => fidelity::run(args, quiet),
        ReproduceName::SysidOod => ood::run(args, quiet),
        ReproduceName::WiggleAblation => wiggles::run(args, quiet),
        ReproduceName::SimPipeline => pipeline::run(args, quiet),
        ReproduceName::LobDrape => lob_drape::run(args, quiet),
        ReproduceName::Robust => robust::run(args, quiet),
        ReproduceName::ParameterImportance => importance::run(args, quiet),
        ReproduceName::SensitivityMaps => sensitivity::run(args, quiet),
    }
}
