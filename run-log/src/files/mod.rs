//! Files of people and runs: reading with errors that name file and field,
//! writing so that nothing is ever half there.

mod arm_response;
mod atomic;
mod cell;
mod motion;
mod plan;
mod rope;
mod text;

pub use arm_response::{read_arm_response, read_excitation, write_arm_response};
pub use atomic::{check_writable, write_atomic, write_json};
pub use cell::read_cell;
pub use motion::{JointsCsv, PoseSample, read_joints, read_pose, write_joints, write_trajectory};
pub use plan::read_plan;
pub use rope::{read_doubts, read_posterior, read_rope, write_rope_estimate};
pub use text::{read_json, read_text};

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
/// File of a run folder with the tracked keypoints.
pub const KEYPOINTS: &str = "keypoints.json";
/// File of a run folder with the identified rope.
pub const ROPE: &str = "params.toml";
/// File of a run folder with the plan of the throw.
pub const PLAN: &str = "plan.json";
