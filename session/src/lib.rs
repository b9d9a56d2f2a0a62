//! What a command that moves an arm works in: child processes that are started, watched and
//! ended together, the operator at standard input, what comes over shared memory meanwhile,
//! and the file of the run.
//!
//! A [`Session`] knows none of the processes by name: what is started and asked is its user's.
//! What all such commands ask of the controller is in [`arm`].

// Its macros stand for the standard ones everywhere below.
#[macro_use]
extern crate cli_output;

pub mod arm;
mod live;
mod presence;
mod received;
mod run_file;
mod service;
mod supervisor;

pub use live::{Confirmation, Session};
pub use presence::Switch;
pub use received::Received;
use run_file::RunFile;
pub use run_file::remedy;
pub use service::{has_stopped, of_service};
pub use supervisor::{ProcessSpec, Supervisor};
