//! Runs as one data set for LeRobot, the library for robot learning, in its format v3.0.
//!
//! Each run is an episode: [`episode`] samples it at a fixed rate, [`features`] puts that under
//! the names that the library knows, [`set`] writes the folder. Needs the feature `lerobot`: the
//! writer of Parquet costs more to build than the rest of this crate.

mod columns;
mod data;
mod episode;
mod features;
mod grid;
mod meta;
mod pictures;
mod samples;
mod set;
mod statistics;

use crate::destination_file::go_on;
use crate::destination_folder::Destination;
use crate::written::Written;
use cli_output::{OrInput, Outcome, bad_input};
use std::path::{Path, PathBuf};

/// Writes runs into the folder `out` as one data set of the format v3.0, an episode each, `fps`
/// frames a second, or else as many as they have pictures. `out` must not exist, or be an earlier
/// export, which is replaced.
///
/// # Errors
/// A run cannot be read, or cannot be had at this rate; runs differ in their rate, the size of
/// their pictures or the number of their keypoints; `out` is something else, or cannot be
/// written.
pub fn lerobot(runs: &[PathBuf], out: &Path, fps: Option<u32>) -> Outcome<Written> {
    let destination = Destination::new(out, set::is_set).or_input()?;
    for (index, run) in runs.iter().enumerate() {
        let same = |other: &PathBuf| run.canonicalize().ok() == other.canonicalize().ok();
        if runs.iter().take(index).any(same) {
            return Err(bad_input!(
                "`{}` is named twice: each run is one episode",
                run.display()
            ));
        }
    }
    let mut set = set::Set::new(destination.building().to_owned());
    for run in runs {
        go_on().or_failed()?;
        let episode = episode::Episode::read(run, fps)?;
        set.check(&episode).or_input()?;
        set.add(&episode).or_failed()?;
    }
    let written = set.finish(out).or_failed()?;
    destination.put().or_failed()?;
    Ok(written)
}
