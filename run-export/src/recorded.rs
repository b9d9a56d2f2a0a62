//! What the formats have in common of a run: its control cycles, and where its time begins.

use cli_output::{OrInput, Outcome, bad_input};
use run_log::{Cycles, Run};
use std::path::Path;

/// A run with recorded control cycles.
pub(crate) struct RecordedRun {
    /// Its folder.
    pub(crate) run: Run,
    /// Control cycles, at least one, and joint reports.
    pub(crate) cycles: Cycles,
    /// Zero of the run's other files, or else its first cycle (CLOCK_MONOTONIC, ns).
    pub(crate) epoch_ns: u64,
    /// What is missing of its file, in words.
    pub(crate) flaws: Vec<String>,
}

impl RecordedRun {
    /// Reads a run folder, or its file `run.mcap` (`cycles.bin` of an older version).
    ///
    /// # Errors
    /// It cannot be read, or holds no control cycle.
    pub(crate) fn read(path: &Path) -> Outcome<Self> {
        let run = Run::open(path).or_input()?;
        let cycles = run.recording().and_then(|recording| recording.cycles());
        let cycles = cycles.or_input()?;
        let Some(first) = cycles.cycles.first() else {
            return Err(bad_input!("`{}` holds no control cycle", path.display()));
        };
        let epoch_ns = run.epoch_ns().or_input()?.unwrap_or(first.deadline_ns);
        Ok(Self {
            flaws: run.flaws().or_input()?,
            run,
            cycles,
            epoch_ns,
        })
    }
}
