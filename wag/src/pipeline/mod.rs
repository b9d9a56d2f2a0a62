//! The stages of a throw, in the order data flows through them:
//! start -> wiggle -> track -> identify -> plan -> calm -> throw -> score.
//!
//! Each stage asks one process and returns what the next one needs.

mod arm;
mod calm;
mod observe;
mod processes;
mod run_folder;
mod stages;

pub use arm::{ArmLink, acquire, arm_for, execute, latency, move_to};
pub use calm::{CalmInput, Calmed, calm};
pub use observe::{Film, Shot, film_during};
pub use processes::{
    ArmAddress, arm_ports, preview_spec, rig_config, shipped_rig, start_camera, start_controller,
    start_planner, start_recorder, start_rig, write_calibration,
};
pub use run_folder::RunFolder;
pub use stages::{Tracked, identify, plan_strike, score, track, wait_still};

use std::time::Duration;

/// How long a process may take to come up.
pub const STARTUP: Duration = Duration::from_secs(15);
