//! Recordings of control cycles: written beside a run, read back, explained.
//!
//! `cycles.bin` holds every cycle's inputs and answers
//! ([`rt_controller::recording`]). A thread of its own writes it, fed from
//! shared memory: a slow or full disk costs chunks, which are counted, and never
//! time in the controller.

mod cause;
mod explanation;
mod flight;
mod folder;
mod margins;
mod page;
mod thread;
mod writer;

pub use cause::{explain_stop, keep_cause};
pub use explanation::{Explanation, explain};
pub use flight::Flight;
pub use folder::read_recording;
pub use page::show;
pub use thread::{RecordingReport, RecordingThread};

/// File of a run folder that holds its control cycles.
pub const CYCLES_FILE: &str = "cycles.bin";
/// File of a run folder that says why the arm was stopped.
pub const CAUSE_FILE: &str = "cause.json";
