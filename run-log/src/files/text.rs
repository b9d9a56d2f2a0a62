//! Text files, and values in them.

use crate::error::At;
use crate::{Error, Result};
use serde::de::DeserializeOwned;
use std::path::Path;

/// Reads a text file.
///
/// # Errors
/// [`Error::Read`].
pub fn read_text(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).map_err(Error::read(path))
}

/// Reads JSON.
///
/// # Errors
/// The file cannot be read, or does not hold such a value.
pub fn read_json<T: DeserializeOwned>(path: &Path) -> Result<T> {
    serde_json::from_str(&read_text(path)?).at(|| format!("`{}`", path.display()))
}
