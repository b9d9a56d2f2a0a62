//! Trials kept in a file, so that none is made twice.

use anyhow::{Context, anyhow};
use run_log::files;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The file of one result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Checkpoint<T> {
    pub name: String,
    /// Version and hash of the program that made the trials.
    pub program: String,
    /// Seed of ropes, films and searches.
    pub seed: u64,
    pub method: String,
    /// Trials in the order of their indices.
    pub trials: Vec<T>,
}

impl<T: Serialize + DeserializeOwned> Checkpoint<T> {
    /// What an earlier run left at `path`, or nothing yet.
    pub(super) fn open(path: Option<&Path>, empty: Self) -> anyhow::Result<Self> {
        let Some(path) = path.filter(|p| p.exists()) else {
            return Ok(empty);
        };
        let fail = || format!("result file `{}`", path.display());
        let found: Self = serde_json::from_str(&files::read_text(path)?).with_context(fail)?;
        let same = found.name == empty.name
            && found.program == empty.program
            && found.seed == empty.seed
            && found.method == empty.method;
        if same {
            return Ok(found);
        }
        Err(anyhow!(
            "is of `{}`, program {}, seed {}, method {}: name another file with --out, or remove it",
            found.name,
            found.program,
            found.seed,
            found.method
        ))
        .with_context(fail)
    }

    pub(super) fn write(&self, path: Option<&Path>) -> anyhow::Result<()> {
        path.map_or(Ok(()), |path| files::write_json(path, self))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::program;

    #[test]
    fn a_file_of_another_seed_is_refused_and_the_same_goes_on() {
        let empty = |seed| Checkpoint::<u8> {
            name: "sysid".to_owned(),
            program: program().unwrap(),
            seed,
            method: "hybrid".to_owned(),
            trials: Vec::new(),
        };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("result.json");
        assert_eq!(Checkpoint::open(Some(&path), empty(1)).unwrap(), empty(1));
        empty(1).write(Some(&path)).unwrap();
        assert_eq!(Checkpoint::open(Some(&path), empty(1)).unwrap(), empty(1));
        let error = format!("{:#}", Checkpoint::open(Some(&path), empty(2)).unwrap_err());
        assert!(
            error.contains("result.json") && error.contains("seed 1"),
            "{error}"
        );
    }
}
