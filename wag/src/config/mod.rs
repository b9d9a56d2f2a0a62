//! Configuration in layers: what is built in, what a site's folder says, what a rig's
//! folder says, and the file named for one run. Each says only what differs.

mod kind;
mod layers;
mod nearest;

pub use kind::{Configured, Kind};
pub use layers::{Folders, Layers};

use std::path::Path;

/// What holds here: all layers, with `run` on top.
pub fn here<T: Configured>(run: Option<&Path>) -> anyhow::Result<T> {
    Layers::read(T::KIND, &Folders::here()?, run)?.get()
}

/// Refuses to begin with files that cannot be read as what they configure.
pub fn check_here() -> anyhow::Result<()> {
    let folders = Folders::here()?;
    Kind::ALL
        .into_iter()
        .try_for_each(|kind| Layers::read(kind, &folders, None).map(drop))
}

/// What is built in alone, whatever this machine's folders say: for results that must be
/// the same everywhere.
pub fn built_in<T: Configured>() -> anyhow::Result<T> {
    Layers::read(T::KIND, &Folders::NONE, None)?.get()
}
