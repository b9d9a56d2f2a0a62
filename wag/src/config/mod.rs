//! Configuration in layers: what is built in, what a site's folder says, what a rig's
//! folder says, and the file named for one run. Each says only what differs.

mod kind;
mod layers;

pub use kind::{Configured, Kind};
pub use layers::Layers;

use anyhow::bail;
use arm_model::Cell;
use clap::ValueEnum;
use layers::{Folders, difference};
use run_log::files::{CAMERA, misnamed};
use run_log::{CellHere, Run};
use shared_types::Plan;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Name of the file that says how an arm follows its setpoints.
pub const RESPONSE_FILE: &str = "arm-response.toml";

/// The file of the cell that the command line names.
static CELL_FILE: OnceLock<PathBuf> = OnceLock::new();

/// The cell, read once: whatever one command computes, starts and writes has the same.
static CELL: OnceLock<CellHere> = OnceLock::new();

/// Takes the cell's file from the command line; the first one counts.
pub fn name_cell(file: &Path) {
    let _ = CELL_FILE.set(file.to_owned());
}

/// The cell to look at runs in: the file named on the command line goes before what a run
/// tells, the layers after it.
pub fn cell_here() -> anyhow::Result<CellHere> {
    if let Some(read) = CELL.get() {
        return Ok(*read);
    }
    let cell = layers(Kind::Cell, None)?.get()?;
    let is_named = CELL_FILE.get().is_some();
    Ok(*CELL.get_or_init(|| CellHere { cell, is_named }))
}

/// The cell that holds here, with the file named on the command line on top.
pub fn cell() -> anyhow::Result<Cell> {
    Ok(cell_here()?.cell)
}

pub fn cell_of(run: &Run) -> anyhow::Result<Cell> {
    Ok(cell_here()?.of_run(run.cell()?))
}

/// The cell that holds here, for a plan that must have been made for it.
pub fn cell_for(plan: &Plan) -> anyhow::Result<Cell> {
    let here = cell()?;
    if let Some(planned) = &plan.cell
        && let Some(differs) = difference(planned, &here)?
    {
        bail!(
            "the plan was made for another cell: {differs}; pass the plan's cell with --cell FILE \
             (a run's is RUN/config/cell.toml), or plan anew"
        );
    }
    Ok(here)
}

/// The layers of a kind here, with `run` on top; on top of the cell's, the file that the
/// command line names.
pub fn layers(kind: Kind, run: Option<&Path>) -> anyhow::Result<Layers> {
    let named = CELL_FILE.get().filter(|_| kind == Kind::Cell);
    let run = run.or(named.map(PathBuf::as_path));
    let layers = Layers::read(kind, &Folders::here()?, run)?;
    layers.refuse_other_cell(cell)?;
    Ok(layers)
}

/// What holds here: all layers, with `run` on top, in the cell that holds here.
pub fn here<T: Configured>(run: Option<&Path>) -> anyhow::Result<T> {
    let config: T = layers(T::KIND, run)?.get()?;
    Ok(config.in_cell(cell()?))
}

/// Where a file that belongs to this place is looked for: a rig's folder goes before a site's.
fn places(file: &str) -> anyhow::Result<impl Iterator<Item = PathBuf>> {
    let Folders { site, rig } = Folders::here()?;
    let folders = [rig, site].into_iter().flatten();
    Ok(folders.map(move |folder| folder.join(file)))
}

/// Where the file that tells how the arm of this place follows its setpoints is looked for.
pub fn arm_response_files() -> anyhow::Result<impl Iterator<Item = PathBuf>> {
    places(RESPONSE_FILE)
}

/// The settings of the camera of this place, if they are there.
pub fn camera_file() -> anyhow::Result<Option<PathBuf>> {
    Ok(places(CAMERA)?.find(|file| file.exists()))
}

/// Refuses to begin with files that cannot be read as what they configure, and warns of those that
/// nothing reads because of a slip in their name.
pub fn check_here() -> anyhow::Result<()> {
    let kinds = Kind::value_variants()
        .iter()
        .map(|kind| kind.built_in().file);
    let read: Vec<&str> = kinds.chain([CAMERA, RESPONSE_FILE]).collect();
    let Folders { site, rig } = Folders::here()?;
    for folder in [site, rig].into_iter().flatten() {
        for (path, meant) in misnamed(&folder, &read) {
            tracing::warn!("`{}` is not read; did you mean `{meant}`?", path.display());
        }
    }
    Kind::value_variants()
        .iter()
        .try_for_each(|kind| layers(*kind, None).map(drop))
}

/// What is built in alone, whatever this machine's folders say: for results that must be
/// the same everywhere.
pub fn built_in<T: Configured>() -> anyhow::Result<T> {
    Layers::read(T::KIND, &Folders::default(), None)?.get()
}
