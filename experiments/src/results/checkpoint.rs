//! Trials kept in a file, so that none is made twice.

use crate::args::Shard;
use crate::program::program;
use anyhow::{Context, anyhow, bail, ensure};
use rope_sim::Precision;
use run_log::files;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;
use std::path::{Path, PathBuf};

/// What makes trials what they are: of two files with the same one, trials of the same index are
/// the same.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Origin {
    pub name: String,
    /// Version and hash of the program that made the trials.
    pub program: String,
    /// The simulator's kernels on the processor: another sums in another order.
    pub kernels: String,
    /// Seed of ropes, films and searches.
    pub seed: u64,
    pub method: String,
    /// Hash of the network that is asked, if one is.
    pub network: Option<String>,
    /// Trials of the whole study.
    pub count: u64,
}

impl Origin {
    /// Of trials that this program makes on this processor.
    pub(super) fn here(
        name: &str,
        (seed, method): (u64, String),
        network: Option<String>,
        count: u64,
    ) -> anyhow::Result<Self> {
        let kernels = [Precision::F32, Precision::F64].map(Precision::fastest_kernel);
        Ok(Self {
            name: name.to_owned(),
            program: program()?,
            kernels: format!("{kernels:?}"),
            seed,
            method,
            network,
            count,
        })
    }
}

/// The file of one result, or of a shard of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Checkpoint<T> {
    #[serde(flatten)]
    pub origin: Origin,
    /// Which of the trials it has.
    #[serde(default, skip_serializing_if = "Shard::is_whole")]
    pub shard: Shard,
    /// Trials in the order of their indices.
    pub trials: Vec<T>,
}

impl<T: Serialize + DeserializeOwned> Checkpoint<T> {
    /// What an earlier run left at `path`, or nothing yet.
    pub(super) fn open(path: Option<&Path>, empty: Self) -> anyhow::Result<Self> {
        let Some(path) = path.filter(|p| p.exists()) else {
            return Ok(empty);
        };
        let found: Self = read(path)?;
        // A whole study may be made longer; trials that are too many are left out. A shard's other
        // trials belong to other shards then.
        let count = if empty.shard.is_whole() {
            empty.origin.count
        } else {
            found.origin.count
        };
        let as_long = Origin {
            count,
            ..found.origin.clone()
        };
        if as_long == empty.origin && found.shard == empty.shard {
            return Ok(Self {
                origin: as_long,
                ..found
            });
        }
        let (of, shard) = (found.origin, found.shard);
        Err(anyhow!(
            "is of `{}`, program {}, kernels {}, seed {}, method {}, network {}, shard {shard} of {} trials: name another file with --out, or remove it",
            of.name,
            of.program,
            of.kernels,
            of.seed,
            of.method,
            of.network.as_deref().unwrap_or("none"),
            of.count
        ))
        .with_context(|| format!("result file `{}`", path.display()))
    }

    pub(super) fn write(&self, path: Option<&Path>) -> anyhow::Result<()> {
        path.map_or(Ok(()), |path| files::write_json(path, self))
    }
}

fn read<T: DeserializeOwned>(path: &Path) -> anyhow::Result<T> {
    let text = files::read_text(path)?;
    serde_json::from_str(&text).with_context(|| {
        format!(
            "`{}` is no result file of this version: name another file, or remove it",
            path.display()
        )
    })
}

/// Whether a shard's file has all its trials.
///
/// # Errors
/// It cannot be read, or is of another version.
pub fn is_finished(shard: &Path) -> anyhow::Result<bool> {
    let found: Checkpoint<Box<RawValue>> = read(shard)?;
    Ok(found.trials.len() as u64 == found.shard.len(found.origin.count))
}

/// Writes the trials of all shards into one file, byte for byte as one process would have; how
/// many they are.
///
/// # Errors
/// A shard is missing, not finished, there twice, or made of something else.
pub fn merge(shards: &[PathBuf], out: &Path) -> anyhow::Result<u64> {
    let mut found: Vec<Option<Checkpoint<Box<RawValue>>>> = Vec::new();
    let mut origin: Option<Origin> = None;
    for path in shards {
        let one: Checkpoint<Box<RawValue>> = read(path)?;
        let name = || format!("`{}`", path.display());
        let expected = origin.get_or_insert_with(|| one.origin.clone());
        ensure!(
            one.origin == *expected,
            "{} is of another study, program, processor, seed, method, network or number of trials than `{}`",
            name(),
            shards[0].display()
        );
        if found.is_empty() {
            found.resize_with(usize::try_from(one.shard.of)?, || None);
        }
        ensure!(
            found.len() as u64 == one.shard.of,
            "{} is shard {}, but there are {} others",
            name(),
            one.shard,
            found.len()
        );
        let wanted = one.shard.len(one.origin.count);
        ensure!(
            one.trials.len() as u64 == wanted,
            "{} is not finished: {} of {wanted} trials; the command that made it resumes",
            name(),
            one.trials.len()
        );
        let place = &mut found[usize::try_from(one.shard.number - 1)?];
        ensure!(
            place.is_none(),
            "{} is shard {} once more",
            name(),
            one.shard
        );
        *place = Some(one);
    }
    let Some(origin) = origin else {
        bail!("name the shards' files");
    };
    if let Some(missing) = found.iter().position(Option::is_none) {
        bail!("shard {}/{} is missing", missing + 1, found.len());
    }
    let mut each: Vec<_> = found
        .into_iter()
        .flatten()
        .map(|s| s.trials.into_iter())
        .collect();
    let (count, shards) = (origin.count, each.len() as u64);
    let next = |index: u64| each[usize::try_from(index % shards).unwrap_or(0)].next();
    let trials = (0..count).filter_map(next).collect();
    let whole = Checkpoint {
        origin,
        shard: Shard::WHOLE,
        trials,
    };
    files::write_json(out, &whole)?;
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn empty(seed: u64, count: u64, shard: Shard) -> Checkpoint<f64> {
        Checkpoint {
            origin: Origin::here("sysid", (seed, "hybrid".to_owned()), None, count).unwrap(),
            shard,
            trials: Vec::new(),
        }
    }

    #[test]
    fn a_file_of_another_seed_or_shard_is_refused_and_the_same_goes_on() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("result.json");
        let whole = empty(1, 5, Shard::WHOLE);
        let open = |empty| Checkpoint::open(Some(&path), empty);
        assert_eq!(open(whole.clone()).unwrap(), whole);
        whole.write(Some(&path)).unwrap();
        assert_eq!(open(whole).unwrap(), empty(1, 5, Shard::WHOLE));
        assert_eq!(open(empty(1, 9, Shard::WHOLE)).unwrap().origin.count, 9);
        for other in [
            empty(2, 5, Shard::WHOLE),
            empty(1, 5, Shard { number: 1, of: 2 }),
            Checkpoint {
                origin: Origin {
                    network: Some("abc".to_owned()),
                    ..empty(1, 5, Shard::WHOLE).origin
                },
                ..empty(1, 5, Shard::WHOLE)
            },
        ] {
            let error = format!("{:#}", open(other).unwrap_err());
            let told = error.contains("result.json") && error.contains("seed 1");
            assert!(told && error.contains("shard 1/1"), "{error}");
        }
    }

    /// Writes the shards of `count` trials, each a number that is hard to print.
    fn shards(dir: &Path, count: u64, of: u64) -> Vec<PathBuf> {
        let write = |number| {
            let mut one = empty(1, count, Shard { number, of });
            let trials = 0..one.shard.len(count);
            one.trials = trials.map(|k| 0.1 + one.shard.trial(k) as f64).collect();
            let path = dir.join(format!("shard-{number}.json"));
            one.write(Some(&path)).unwrap();
            path
        };
        (1..=of).map(write).collect()
    }

    #[test]
    fn merged_shards_have_the_bytes_of_one_process() {
        let dir = tempfile::tempdir().unwrap();
        let [out, one] = ["all.json", "one.json"].map(|name| dir.path().join(name));
        let mut whole = empty(1, 23, Shard::WHOLE);
        whole.trials = (0..23).map(|i| 0.1 + f64::from(i)).collect();
        whole.write(Some(&one)).unwrap();
        for of in [1, 2, 5, 23, 30] {
            let mut paths = shards(dir.path(), 23, of);
            paths.reverse();
            assert_eq!(merge(&paths, &out).unwrap(), 23);
            assert_eq!(std::fs::read(&out).unwrap(), std::fs::read(&one).unwrap());
        }
    }

    #[test]
    fn shards_that_do_not_make_a_whole_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("all.json");
        let paths = shards(dir.path(), 10, 3);
        let refused = |paths: &[PathBuf]| format!("{:#}", merge(paths, &out).unwrap_err());
        assert!(refused(&paths[..2]).contains("shard 3/3 is missing"));
        let twice = [paths[0].clone(), paths[0].clone()];
        assert!(refused(&twice).contains("shard 1/3 once more"));
        let mut unfinished = empty(1, 10, Shard { number: 2, of: 3 });
        unfinished.trials = vec![1.0];
        unfinished.write(Some(&paths[1])).unwrap();
        assert!(refused(&paths).contains("1 of 3 trials"));
        empty(2, 10, Shard { number: 2, of: 3 })
            .write(Some(&paths[1]))
            .unwrap();
        assert!(refused(&paths).contains("another study"));
        assert!(!out.exists());
    }
}
