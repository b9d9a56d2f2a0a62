//! Runs as one data set for LeRobot, the library for robot learning, in its format v3.0.
//!
//! Each run is an episode: [`episode`] samples it at a fixed rate, [`features`] puts that under
//! the names that the library knows, [`set`] writes the folder. Needs the feature `lerobot`: the
//! writer of Parquet costs more to build than the rest of this crate.

#[cfg(feature = "lerobot")]
mod columns;
#[cfg(feature = "lerobot")]
mod data;
#[cfg(feature = "lerobot")]
mod episode;
#[cfg(feature = "lerobot")]
mod features;
#[cfg(feature = "lerobot")]
mod grid;
#[cfg(feature = "lerobot")]
mod meta;
#[cfg(feature = "lerobot")]
mod pictures;
#[cfg(feature = "lerobot")]
mod samples;
#[cfg(feature = "lerobot")]
mod set;
#[cfg(feature = "lerobot")]
mod statistics;

use crate::written::Written;
use cli_output::Outcome;
use std::path::{Path, PathBuf};

/// Writes runs into the folder `out` as one data set of the format v3.0, an episode each, `fps`
/// frames a second, or else as many as they have pictures. `out` must not exist, or be an earlier
/// export, which is replaced.
///
/// # Errors
/// A run cannot be read, or cannot be had at this rate; runs differ in their rate, the size of
/// their pictures or the number of their keypoints; `out` is something else, or cannot be
/// written.
#[cfg(feature = "lerobot")]
pub fn lerobot(runs: &[PathBuf], out: &Path, fps: Option<u32>) -> Outcome<Written> {
    use crate::destination::Destination;
    use cli_output::{OrInput, bad_input};

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
        Destination::go_on().or_failed()?;
        let episode = episode::Episode::read(run, fps)?;
        set.check(&episode).or_input()?;
        set.add(&episode).or_failed()?;
    }
    let written = set.finish(out).or_failed()?;
    destination.put().or_failed()?;
    Ok(written)
}

/// Always refuses.
///
/// # Errors
/// How a build that can is made.
#[cfg(not(feature = "lerobot"))]
pub fn lerobot(_runs: &[PathBuf], _out: &Path, _fps: Option<u32>) -> Outcome<Written> {
    Err(cli_output::bad_input!(
        "this build cannot write data sets for LeRobot; build it with `cargo build --release -p \
         wag --features lerobot` (the Debian package has it)"
    ))
}

#[cfg(all(test, not(feature = "lerobot")))]
mod tests {
    use super::*;

    #[test]
    fn a_build_without_it_says_how_one_with_it_is_made() {
        let failure = lerobot(&[], Path::new("set"), None).unwrap_err();
        assert_eq!(failure.exit_code(), 2);
        assert!(failure.to_string().contains("--features lerobot"));
    }
}
