//! A running set of processes: started, watched, recorded, ended together.

mod live;
mod presence;
mod received;
mod run_file;
mod supervisor;

pub use live::{Confirmation, Session};
pub use presence::Switch;
use received::Received;
use run_file::RunFile;
pub use run_file::remedy;
pub use supervisor::{ProcessSpec, Supervisor};
