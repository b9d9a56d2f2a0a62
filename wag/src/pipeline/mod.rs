//! The stages of a throw, in the order data flows through them:
//! start -> wiggle -> track -> identify -> plan -> settle -> throw -> score.
//!
//! Each stage asks one process and returns what the next one needs.

mod arm;
mod observe;
mod processes;
mod run_folder;
mod settle;
mod stages;

pub use arm::{ArmLink, acquire, arm_for, execute, latency, move_to};
pub use observe::{Film, Shot, film_during};
pub use processes::{
    ArmAddress, arm_ports, preview_spec, rig_config, shipped_rig, start_camera, start_controller,
    start_planner, start_recorder, start_rig, write_calibration,
};
pub use run_folder::RunFolder;
pub use settle::{SettleInput, Settled, settle};
pub use stages::{Tracked, identify, plan, score, track, wait_still};

use std::time::Duration;

/// How long a process may take to come up.
pub const STARTUP: Duration = Duration::from_secs(15);
