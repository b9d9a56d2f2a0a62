//! A recorded run in the formats of other programs, for those who work on it with their own.
//!
//! Each format is a module with one function: of the type [`Write`], but for [`lerobot()`], which
//! takes several runs. It reads a run through [`run_log::Run`], which it never changes, and writes
//! whole files or whole folders: what fails leaves nothing behind. Wrong input is told apart from a
//! failure to write, as [`cli_output::Failure`] has it.
//!
//! ```no_run
//! # fn main() -> cli_output::Outcome {
//! let written = run_export::csv(std::path::Path::new("runs/NAME"), None)?;
//! println!("{}", written.report("csv"));
//! # Ok(())
//! # }
//! ```
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

mod command;
mod csv;
mod destination;
mod foxglove;
mod lerobot;
mod npz;
mod recorded;
pub mod ros2;
mod written;

pub use command::{ExportArgs, ExportCommand, LerobotArgs};
pub use csv::csv;
pub use foxglove::foxglove;
pub use lerobot::lerobot;
pub use npz::npz;
pub use ros2::ros2;
pub use written::{Written, WrittenFile};

use std::path::Path;

/// Writes the run of a folder, or of its file `run.mcap`, to where it is told, or else into
/// the run's folder.
pub type Write = fn(run: &Path, out: Option<&Path>) -> cli_output::Outcome<Written>;
