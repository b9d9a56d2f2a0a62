//! Where a recording lies.

use super::CYCLES_FILE;
use crate::error::At;
use crate::mcap_file::{RUN_FILE, is_mcap, replay_bytes};
use crate::{Error, Result};
use std::path::Path;

/// The bytes of the recording in a run folder; a file is taken as it is.
///
/// # Errors
/// There is no recording, or it cannot be read.
pub fn read_recording(run: &Path) -> Result<Vec<u8>> {
    if !run.exists() {
        return Err(Error::NoRun(run.to_owned()));
    }
    let file = if run.is_dir() {
        // Either will do; the smaller one is read sooner.
        [CYCLES_FILE, RUN_FILE]
            .map(|name| run.join(name))
            .into_iter()
            .find(|file| file.is_file())
            .ok_or_else(|| Error::NoRecording(run.to_owned()))?
    } else {
        run.to_owned()
    };
    let bytes = std::fs::read(&file).map_err(Error::read(&file))?;
    if is_mcap(&bytes) {
        return replay_bytes(&bytes).at(|| format!("`{}`", file.display()));
    }
    Ok(bytes)
}
