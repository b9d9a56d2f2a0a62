//! Why a calibration cannot be used.

use std::path::{Path, PathBuf};

use crate::whole_file::write_whole;

/// Why a calibration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum CalibError {
    /// The file cannot be read or written.
    #[error("calibration {path}: {source} (check the path and its permissions)")]
    Io {
        /// File concerned.
        path: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// `camera.toml` cannot be used.
    #[error("camera settings {path}: {reason}")]
    Settings {
        /// File concerned.
        path: PathBuf,
        /// What is wrong, with the field.
        reason: String,
    },
    /// The calibration that it names cannot be used.
    #[error("calibration {path}: {reason}")]
    Calibration {
        /// File concerned.
        path: PathBuf,
        /// What is wrong, with the line or the key.
        reason: String,
    },
}

impl CalibError {
    pub(super) fn io(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::Io {
            path: path.to_owned(),
            source,
        }
    }

    pub(super) fn settings(path: &Path, reason: impl ToString) -> Self {
        Self::Settings {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }

    pub(super) fn calibration(path: &Path, reason: impl ToString) -> Self {
        Self::Calibration {
            path: path.to_owned(),
            reason: reason.to_string(),
        }
    }
}

pub(super) fn read_text(path: &Path) -> Result<String, CalibError> {
    std::fs::read_to_string(path).map_err(CalibError::io(path))
}

pub(super) fn write_text(path: &Path, text: &str) -> Result<(), CalibError> {
    write_whole(path, text.as_bytes()).map_err(CalibError::io(path))
}
