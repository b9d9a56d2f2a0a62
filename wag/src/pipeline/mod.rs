//! What the commands that move an arm have in common: the run's folder and its processes.

mod camera;
mod processes;
mod run_folder;
mod service;

pub use camera::{FramesFrom, Scene, start_camera};
pub use processes::{ArmAddress, controller, rig_config, start, start_recorder, start_rig};
pub use run_folder::RunFolder;
pub use service::Service;
