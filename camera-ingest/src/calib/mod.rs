//! Calibration files: the vendor's factory `.conf` and this system's
//! `camera.toml`, read into and written from a [`StereoCamera`].
//!
//! It is *not* the place for estimating a calibration.

mod factory;
mod ini;
mod settings;

use std::path::{Path, PathBuf};

pub use factory::{VideoMode, write_factory_conf};
pub use settings::write_camera_toml;
use shared_types::StereoCamera;

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
    /// `camera.toml` does not parse.
    #[error("camera settings {path}: {reason}")]
    Settings {
        /// File concerned.
        path: PathBuf,
        /// What the parser says, with field and line.
        reason: String,
    },
    /// A line of the factory file is neither section, key nor comment.
    #[error(
        "calibration {path}, line {line}: expected `key=value` or `[section]`, found {text:?}; \
         is this a factory SNxxxx.conf?"
    )]
    Line {
        /// File concerned.
        path: PathBuf,
        /// Line number, from 1.
        line: usize,
        /// The text.
        text: String,
    },
    /// A number is missing.
    #[error("calibration {path}: [{section}] has no `{key}`; the mode `{mode}` needs it")]
    Missing {
        /// File concerned.
        path: PathBuf,
        /// Section looked at.
        section: String,
        /// Key looked for.
        key: String,
        /// Mode asked for.
        mode: &'static str,
    },
    /// A value is not a usable number.
    #[error("calibration {path}: [{section}] {key} = {text:?} {problem}")]
    Value {
        /// File concerned.
        path: PathBuf,
        /// Section.
        section: String,
        /// Key.
        key: String,
        /// Text found.
        text: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// The calibration is of a kind that is not read.
    #[error(
        "calibration {path}: camera_info YAML is not supported; give the camera's factory \
         SNxxxx.conf (the vendor's tool stores it under its settings folder)"
    )]
    Unsupported {
        /// File concerned.
        path: PathBuf,
    },
}

/// Reads `camera.toml` and the calibration it names (relative to it).
///
/// # Errors
/// A file is missing or malformed, a mode is absent from the calibration, or a
/// number is impossible; the message names file, section and key.
pub fn load_camera(path: &Path) -> Result<StereoCamera, CalibError> {
    let settings = settings::read(path)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    let calibration = folder.join(&settings.calibration);
    if calibration
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"))
    {
        return Err(CalibError::Unsupported { path: calibration });
    }
    let eyes = factory::read(&calibration, settings.mode)?;
    Ok(settings.camera(eyes))
}

fn read_text(path: &Path) -> Result<String, CalibError> {
    std::fs::read_to_string(path).map_err(|source| CalibError::Io {
        path: path.to_owned(),
        source,
    })
}

fn write_text(path: &Path, text: &str) -> Result<(), CalibError> {
    std::fs::write(path, text).map_err(|source| CalibError::Io {
        path: path.to_owned(),
        source,
    })
}
