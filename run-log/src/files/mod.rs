//! Files of people and runs: reading with errors that name file and field,
//! writing so that nothing is ever half there. Every reader fails when its file cannot be
//! read or is not as it should be, every writer when its file cannot be written.

mod atomic;
mod misnamed;
mod motion;
mod rope;
mod text;

pub(crate) use atomic::cannot_write;
pub use atomic::{check_writable, create_folder, write_atomic, write_json};
pub use misnamed::misnamed;
pub use motion::{JointsCsv, read_joints, read_pose, read_table, write_joints, write_trajectory};
pub use rope::{read_posterior, read_rope, read_unconfirmed, write_new_rope, write_rope_estimate};
pub(crate) use text::cannot_read;
pub use text::{
    located, read_arm_response, read_cell, read_excitation, read_json, read_plan, read_text,
    read_toml, write_arm_response,
};

/// File of a run folder that holds the whole run.
pub const RUN: &str = "run.mcap";
/// File in which older versions kept the control cycles beside `run.mcap`; still read.
pub const CYCLES: &str = "cycles.bin";
/// File of a run folder that says why the arm was stopped.
pub const CAUSE: &str = "cause.json";
/// File of a run folder that says how it was made.
pub const COMMAND: &str = "command.json";
/// File of a run folder that holds every figure of it.
pub const SUMMARY: &str = "summary.json";
/// File of a run folder with the cell it ran in.
pub const CELL: &str = "config/cell.toml";
/// What its planner was told.
pub const PLANNER: &str = "config/planner.toml";
/// What its controller was told.
pub const CONTROLLER: &str = "config/rt-controller.toml";
/// File of a run folder with the camera's calibration and extrinsics.
pub const CAMERA: &str = "camera.toml";
/// File of a run folder with the tracked keypoints.
pub const KEYPOINTS: &str = "keypoints.json";
/// File of a run folder with the identified rope.
pub const ROPE: &str = "params.toml";
/// Films of a run folder, if they are kept: `NAME_WIDTHxHEIGHT.yuyv`, times in a CSV beside each.
pub const WIGGLE_FILM: &str = "wiggle";
/// That of the throw.
pub const THROW_FILM: &str = "throw";
/// File of a run folder with the plan of the throw.
pub const PLAN: &str = "plan.json";
