//! The record of a run: written while it goes on, read back, explained.
//!
//! A run is written once, as `run.mcap`: for viewers, and with every control cycle's inputs
//! and answers ([`rt_controller::recording`]) for replay. It is written beside the
//! controller, fed from shared memory: a slow disk costs records, which are counted, and
//! never time in the controller. [`files`] holds the other files of a run folder, written
//! whole or not at all. [`Run::open`] reads all of it.
//!
//! ```
//! use run_log::{Channel, McapFile, recover};
//! use serde_json::json;
//!
//! # fn main() -> anyhow::Result<()> {
//! # let folder = tempfile::tempdir()?;
//! let path = folder.path().join(run_log::files::RUN);
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

mod clamp_motion;
mod columns;
mod command_line;
mod cycle_sample;
mod cycles;
mod earlier;
mod explanation;
pub mod files;
pub mod ledger;
mod margins;
mod mcap_file;
mod page;
mod run;
mod run_outcome;
mod run_record;
mod run_score;
mod tracked_film;
mod unconfirmed;

pub use clamp_motion::ClampMotion;
pub use columns::Column;
pub use command_line::{CommandLine, quoted};
pub use cycle_sample::{CycleSample, Figures, RunLog, WorstJoint};
pub use cycles::Cycles;
pub use earlier::Earlier;
pub use explanation::{Explanation, Late, LimitExceeded, Row, Stop, explain};
pub use margins::Margin;
pub use mcap_file::{
    Channel, Feed, LatestResults, McapFile, NamedSchema, Recorded, RecorderConfig, RecordingCounts,
    Recovered, RopeMotion, RunFileThread, RunFilm, RunPart, SimulateRope, Sink, StandingScene,
    left_jpeg, record, recover,
};
pub use page::show;
pub use run::{CellHere, NoRecording, Recording, Run};
pub use run_outcome::{loop_table, outcome, parameter_table};
pub use run_record::{Film, LATE_MAX_S, MotionSpan, RunRecord, Settled, StageTimes, Tracked};
pub use run_score::{Colours, Kept, NamedFilm, ScoredBy, UNNAMED_COLOURS, require_same_target};
pub use tracked_film::TrackedFilm;
pub use unconfirmed::confirm;
