//! Configuration in layers: what is built in, what a site's folder says, what a rig's
//! folder says, and the file named for one run. Each says only what differs.

mod kind;
mod layers;
mod nearest;

pub use kind::{Configured, Kind};
pub use layers::{Folders, Layers};

use arm_model::Cell;
use clap::ValueEnum;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// The file of the cell that the command line names.
static CELL_FILE: OnceLock<PathBuf> = OnceLock::new();

/// Takes the cell's file from the command line; the first one counts.
pub fn name_cell(file: &Path) {
    let _ = CELL_FILE.set(file.to_owned());
}

/// The cell that holds here, with the file named on the command line on top.
pub fn cell() -> anyhow::Result<Cell> {
    let named = CELL_FILE.get().map(PathBuf::as_path);
    Layers::read(Kind::Cell, &Folders::here()?, named)?.get()
}

/// What holds here: all layers, with `run` on top, in the cell that holds here.
pub fn here<T: Configured>(run: Option<&Path>) -> anyhow::Result<T> {
    let config: T = Layers::read(T::KIND, &Folders::here()?, run)?.get()?;
    Ok(config.in_cell(cell()?))
}

/// Refuses to begin with files that cannot be read as what they configure.
pub fn check_here() -> anyhow::Result<()> {
    let folders = Folders::here()?;
    Kind::value_variants()
        .iter()
        .try_for_each(|kind| Layers::read(*kind, &folders, None).map(drop))
}

/// What is built in alone, whatever this machine's folders say: for results that must be
/// the same everywhere.
pub fn built_in<T: Configured>() -> anyhow::Result<T> {
    Layers::read(T::KIND, &Folders::NONE, None)?.get()
}
