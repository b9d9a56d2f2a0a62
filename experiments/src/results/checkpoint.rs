//! Trials kept in a file, so that none is made twice.

use crate::args::ResultArgs;
use anyhow::{Context, anyhow};
use cli_output::Stage;
use cli_output::interrupted;
use cli_output::{Failure, OrInput, Outcome};
use experiments::trials::{Trial, TrialRig, run};
use planner::sysid::IdentifyOptions;
use run_log::files;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;
use shared_types::ipc::message::Progress;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// Trials made between two writes of the file, at least, and by each thread.
const BATCH: usize = 16;
const EACH: usize = 4;

/// The file of one result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Checkpoint<T> {
    /// Name of the result.
    pub name: String,
    /// Version of the program.
    pub version: String,
    /// Seed of ropes, films and searches.
    pub seed: u64,
    /// Method asked for.
    pub method: String,
    /// Trials in the order of their indices.
    pub trials: Vec<T>,
}

impl<T: Serialize + DeserializeOwned> Checkpoint<T> {
    /// What an earlier run left at `path`, or nothing yet.
    fn open(path: Option<&Path>, empty: Self) -> anyhow::Result<Self> {
        let Some(path) = path.filter(|p| p.exists()) else {
            return Ok(empty);
        };
        let fail = || format!("result file `{}`", path.display());
        let kept: Self = serde_json::from_str(&files::read_text(path)?).with_context(fail)?;
        let same = kept.name == empty.name
            && kept.version == empty.version
            && kept.seed == empty.seed
            && kept.method == empty.method;
        if same {
            return Ok(kept);
        }
        Err(anyhow!(
            "is of `{}`, version {}, seed {}, method {}: name another file with --out, or remove it",
            kept.name,
            kept.version,
            kept.seed,
            kept.method
        ))
        .with_context(fail)
    }

    fn write(&self, path: Option<&PathBuf>) -> anyhow::Result<()> {
        path.map_or(Ok(()), |path| Ok(files::write_json(path, self)?))
    }
}

/// A sequence of trials: how many, how many between two writes, and what is told.
pub(super) struct Sequence<'a, T> {
    /// Name of the result.
    pub name: &'a str,
    /// Method asked for.
    pub method: String,
    /// Trials wanted.
    pub count: u64,
    /// Trials made between two writes of the file.
    pub batch: usize,
    /// Figure of the latest trial, and what it is.
    pub told: (fn(&T) -> f64, &'a str),
}

/// Makes the trials of a sequence, or goes on with those of an earlier run.
pub(super) fn checkpointed_trials<T: Serialize + DeserializeOwned>(
    sequence: &Sequence<'_, T>,
    args: &ResultArgs,
    stage: &Stage,
    mut make: impl FnMut(&[u64]) -> Outcome<Vec<T>>,
) -> Outcome<Vec<T>> {
    let count = sequence.count;
    let empty = Checkpoint {
        name: sequence.name.to_owned(),
        version: shared_types::VERSION.to_owned(),
        seed: args.seed,
        method: sequence.method.clone(),
        trials: Vec::new(),
    };
    let mut kept = Checkpoint::open(args.out.as_deref(), empty).or_input()?;
    kept.trials
        .truncate(usize::try_from(count).unwrap_or(usize::MAX));
    let all: Vec<u64> = (kept.trials.len() as u64..count).collect();
    for batch in all.chunks(sequence.batch) {
        kept.trials.extend(make(batch)?);
        kept.write(args.out.as_ref()).or_failed()?;
        stage.progress(&Progress {
            done: u32::try_from(kept.trials.len()).unwrap_or(u32::MAX),
            total: u32::try_from(count).unwrap_or(u32::MAX),
            value: kept.trials.last().map_or(0.0, sequence.told.0),
            label: sequence.told.1.to_owned(),
        });
        if interrupted().load(Ordering::SeqCst) {
            return Err(Failure::failed(anyhow!(
                "interrupted after {} of {count} ropes{}",
                kept.trials.len(),
                match args.out {
                    Some(_) => "; the same command goes on from there",
                    None => "; with --out FILE it could go on from there",
                }
            )));
        }
    }
    Ok(kept.trials)
}

/// Identifies `count` ropes, or goes on with those of an earlier run.
pub(super) fn trials(
    name: &str,
    args: &ResultArgs,
    count: u64,
    rig: &TrialRig,
    options: &IdentifyOptions,
    rope: impl Fn(u64) -> RopeParams + Sync,
    stage: &Stage,
) -> Outcome<Vec<Trial>> {
    let sequence = Sequence {
        name,
        method: format!("{:?}", options.method).to_lowercase(),
        count,
        batch: BATCH.max(EACH * options.threads),
        told: (|t: &Trial| t.residual_px, "ropes, residual px"),
    };
    checkpointed_trials(&sequence, args, stage, |batch| {
        run(rig, &rope, args.seed, batch, options).or_failed()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn empty(seed: u64) -> Checkpoint<Trial> {
        Checkpoint {
            name: "sysid".to_owned(),
            version: shared_types::VERSION.to_owned(),
            seed,
            method: "hybrid".to_owned(),
            trials: Vec::new(),
        }
    }

    #[test]
    fn a_file_of_another_seed_is_refused_and_the_same_goes_on() {
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
