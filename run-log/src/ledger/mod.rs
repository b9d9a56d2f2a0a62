//! Runs side by side: what was done, with which rope, and what came of it.

mod compare;
mod entry;
mod export;

pub use compare::{Difference, compare};
pub use entry::{Entry, RunResult, read};
pub use export::{csv, table};

use crate::files::{self, cannot_read};
use anyhow::{Context, Result};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Where runs lie by default.
pub const RUNS: &str = "runs";

/// A name for the folder of a run that begins now: the time, what is run, this process.
#[must_use]
pub fn new_name(what: &str) -> String {
    let now = humantime::format_rfc3339_seconds(SystemTime::now()).to_string();
    let stamp: String = now.chars().filter(|c| !matches!(c, ':' | '-')).collect();
    format!("{stamp}-{what}-{}", std::process::id())
}

/// Makes the folder for runs, if it is not there.
///
/// # Errors
/// It cannot be made.
pub fn make_place(runs: &Path) -> Result<()> {
    let cannot = || format!("cannot make the folder `{}` for runs", runs.display());
    std::fs::create_dir_all(runs).with_context(cannot)
}

/// The shared-memory domain of a run whose command is the process `pid`.
#[must_use]
pub fn domain_of_process(pid: u32) -> String {
    format!("run-{pid}")
}

/// The runs in `places`: each is a run folder, or a folder of run folders. In order
/// of their names, which begin with the time.
pub fn find(places: &[PathBuf]) -> Result<Vec<Entry>> {
    let mut found = Vec::new();
    for place in places {
        if is_run(place) {
            found.push(place.clone());
            continue;
        }
        let inside = place.read_dir().map_err(cannot_read(place))?;
        let mut runs: Vec<PathBuf> = inside
            .flatten()
            .map(|entry| entry.path())
            .filter(|path| is_run(path) && is_nameable(path))
            .collect();
        runs.sort();
        found.append(&mut runs);
    }
    found.iter().map(|run| read(run)).collect()
}

/// Whether a list, which is UTF-8, can name a folder; says so where it cannot.
fn is_nameable(folder: &Path) -> bool {
    let is_nameable = folder.to_str().is_some();
    if !is_nameable {
        tracing::warn!("`{}` is left out: its name is not UTF-8", folder.display());
    }
    is_nameable
}

/// Whether a folder is a run's own: it says how it was made or what came of it, or holds
/// its recording.
pub fn is_run(folder: &Path) -> bool {
    [files::COMMAND, files::SUMMARY, files::RUN, files::CYCLES]
        .iter()
        .any(|file| folder.join(file).is_file())
}
