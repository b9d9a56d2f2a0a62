//! What the commands that move an arm have in common: the run's folder, its processes,
//! and asking its controller.

mod arm;
mod camera;
mod processes;
mod run_folder;
mod service;

pub use arm::{
    ArmLink, BringUp, acquire, arm_for, arm_simulated, enable, execute, latency, move_to, refusal,
};
pub use camera::{FramesFrom, Scene, start_camera};
pub use processes::{ArmAddress, controller, rig_config, start, start_recorder, start_rig};
pub use run_folder::RunFolder;
pub use service::Service;
