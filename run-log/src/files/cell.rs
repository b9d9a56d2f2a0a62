//! `cell.toml`: a whole cell, as a run keeps it.

use super::read_text;
use crate::Result;
use crate::error::At;
use arm_model::Cell;
use std::path::Path;

/// Reads a cell.
///
/// # Errors
/// The file cannot be read, or is no cell.
pub fn read_cell(path: &Path) -> Result<Cell> {
    toml::from_str(&read_text(path)?).at(|| format!("cell file `{}`", path.display()))
}
