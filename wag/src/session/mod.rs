//! A running set of processes: started, watched, recorded, ended together.

mod dead_man;
mod live;
mod recorder;
mod run_file;
mod supervisor;

use dead_man::DeadMan;
pub use live::Session;
pub use recorder::Recorder;
use run_file::RunFile;
pub use run_file::simulated_rope;
pub use supervisor::{ProcessSpec, Supervisor};
