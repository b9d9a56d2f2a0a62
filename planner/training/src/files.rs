//! Files written whole or not at all.

use crate::TrainingError;
use std::fs;
use std::path::Path;

/// Writes `bytes` beside the file and renames them into its place.
pub(crate) fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), TrainingError> {
    let beside = path.with_extension("part");
    let failed = |source| TrainingError::file(path, source);
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    fs::write(&beside, bytes).map_err(failed)?;
    fs::rename(&beside, path).map_err(failed)
}

pub(crate) fn read(path: &Path) -> Result<Vec<u8>, TrainingError> {
    fs::read(path).map_err(|source| TrainingError::file(path, source))
}
