//! The record of a run: written while it goes on, read back, explained.
//!
//! A run folder holds `run.mcap` (the whole run, for viewers and for replay) and
//! `cycles.bin` (every control cycle's inputs and answers, [`rt_controller::recording`]).
//! Both are written beside the controller, fed from shared memory: a slow or full disk
//! costs records, which are counted, and never time in the controller. [`files`] holds
//! the other files of a run folder, written whole or not at all.
//!
//! ```
//! use run_log::{Channel, McapFile, is_mcap, recover};
//! use serde_json::json;
//!
//! # fn main() -> run_log::Result<()> {
//! # let folder = tempfile::tempdir().map_err(mcap::McapError::from)?;
//! let path = folder.path().join(run_log::RUN_FILE);
//! let mut file = McapFile::create(&path)?;
//! file.json(Channel::Log, 1_000_000_000, &json!({ "message": "the arm stands" }))?;
//! file.finish()?;
//!
//! let found = recover(&path)?;
//! assert!(found.was_whole && found.messages == 1);
//! # Ok(())
//! # }
//! ```
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

mod cause;
mod chunk_file;
mod cycle_sample;
mod error;
mod explanation;
pub mod files;
mod margins;
mod mcap_file;
mod page;
mod run;
mod tables;
mod thread;

pub use cause::keep_cause;
pub use cycle_sample::{CycleSample, RunLog, WorstJoint};
pub use error::{Error, Result};
pub use explanation::{Broken, Explanation, Late, Row, Stop, explain};
pub use margins::Margin;
pub use mcap_file::{
    Channel, McapFile, RUN_FILE, RecorderConfig, Recovered, RopeMotion, RunFileThread, RunFilm,
    RunPart, SimulateRope, Walked, is_mcap, record, recover, replay_bytes,
};
pub use page::show;
pub use run::{Cycles, Run};
pub use tables::{CYCLES_TABLE, JOINTS_TABLE, measured};
pub use thread::{RecordingReport, RecordingThread};

/// File of a run folder that holds its control cycles.
pub const CYCLES_FILE: &str = "cycles.bin";
/// File of a run folder that says why the arm was stopped.
pub const CAUSE_FILE: &str = "cause.json";
