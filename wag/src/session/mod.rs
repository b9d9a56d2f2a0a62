//! A running set of processes: started, watched, recorded, ended together.

mod dead_man;
mod live;
mod received;
mod run_file;
mod supervisor;

use dead_man::DeadMan;
pub use live::Session;
use received::Received;
use run_file::RunFile;
pub use run_file::remedy;
pub use supervisor::{ProcessSpec, Supervisor};
