//! Why a calibration cannot be used.

use std::fmt::Display;
use std::path::Path;

use shared_types::file_error::why;

use crate::whole_file::write_whole;

/// Which calibration or `camera.toml` cannot be used, why, and what to do.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct CalibError(String);

impl CalibError {
    /// The system's reason at `path`.
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::calibration(path, why(&source))
    }

    /// `camera.toml` cannot be used; `reason` names the field.
    pub(super) fn settings(path: &Path, reason: impl Display) -> Self {
        Self(format!("camera settings {}: {reason}", path.display()))
    }

    /// The calibration that it names cannot be used; `reason` names the line or the key.
    pub(super) fn calibration(path: &Path, reason: impl Display) -> Self {
        Self(format!("calibration {}: {reason}", path.display()))
    }
}

pub(super) fn read_text(path: &Path) -> Result<String, CalibError> {
    std::fs::read_to_string(path).map_err(CalibError::io(path))
}

pub(super) fn write_text(path: &Path, text: &str) -> Result<(), CalibError> {
    write_whole(path, text.as_bytes()).map_err(CalibError::io(path))
}
