//! A recorded run in the formats of other programs, for those who work on it with their own.
//!
//! Each format is a module with one function: of the type [`Write`], but for [`lerobot()`], which
//! takes several runs. It reads a run through [`run_log::Run`], which it never changes, and writes
//! whole files or whole folders: what fails leaves nothing behind. Wrong input is told apart from a
//! failure to write, as [`cli_output::Failure`] has it. Formats that need libraries of
//! their own are features; without them their functions refuse.
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
mod destination_file;
#[cfg(any(feature = "lerobot", feature = "ros2"))]
mod destination_folder;
#[cfg(feature = "foxglove")]
mod foxglove;
#[cfg(feature = "lerobot")]
mod lerobot;
#[cfg(not(all(feature = "foxglove", feature = "lerobot", feature = "ros2")))]
mod not_built;
mod npz;
mod recorded;
#[cfg(feature = "ros2")]
pub mod ros2;
mod written;

pub use command::{ExportArgs, ExportCommand, LerobotArgs};
pub use csv::csv;
#[cfg(feature = "foxglove")]
pub use foxglove::foxglove;
#[cfg(feature = "lerobot")]
pub use lerobot::lerobot;
#[cfg(not(feature = "foxglove"))]
pub use not_built::foxglove;
#[cfg(not(feature = "lerobot"))]
pub use not_built::lerobot;
#[cfg(not(feature = "ros2"))]
pub use not_built::ros2;
pub use npz::npz;
#[cfg(feature = "ros2")]
pub use ros2::ros2;
pub use written::{Written, WrittenFile};

use std::path::Path;

/// Writes the run of a folder, or of its file `run.mcap`, to where it is told, or else into
/// the run's folder.
pub type Write = fn(run: &Path, out: Option<&Path>) -> cli_output::Outcome<Written>;
