//! A data set under way: episodes come one after the other, what the set tells of itself last.

use super::columns::Table;
use super::destination::MARK;
use super::episode::{Episode, Kind};
use super::features::{Gathered, Place, features};
use super::meta::{self, Statistics, Told};
use crate::written::{Written, WrittenFile};
use anyhow::{Context, Result, ensure};
use run_log::files;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A set that is built in a folder.
#[derive(Debug)]
pub(super) struct Set {
    folder: PathBuf,
    runs: Vec<PathBuf>,
    /// What the first episode is like, as all must be.
    kind: Option<Kind>,
    /// The features, as `info.json` has them.
    described: Value,
    /// What the statistics of the whole set are made of.
    gathered: Vec<Gathered>,
    episodes: Vec<Told>,
    /// What is done in the episodes, each once.
    tasks: Vec<String>,
    /// The data file that episodes go into, and the size of its pictures (bytes).
    open: Option<(Table, usize)>,
    /// Data files, with the frames of each.
    data: Vec<WrittenFile>,
    missing: Vec<String>,
}

impl Set {
    /// One without episodes.
    pub(super) fn new(folder: PathBuf) -> Self {
        Self {
            folder,
            runs: Vec::new(),
            kind: None,
            described: Value::Null,
            gathered: Vec::new(),
            episodes: Vec::new(),
            tasks: Vec::new(),
            open: None,
            data: Vec::new(),
            missing: Vec::new(),
        }
    }

    /// Refuses an episode that is not like the first.
    pub(super) fn check(&self, episode: &Episode) -> Result<()> {
        if let (Some(kind), Some(first)) = (self.kind, self.runs.first()) {
            let (run, first) = (episode.run.display(), first.display());
            ensure!(
                episode.kind == kind,
                "the runs of a data set must be alike, but `{first}` has {kind}, and `{run}` has {}: \
                 export them apart, or, if only the rates differ, name one with --fps",
                episode.kind
            );
        }
        Ok(())
    }

    /// Adds an episode like the first.
    pub(super) fn add(&mut self, episode: &Episode) -> Result<()> {
        let known = self.tasks.iter().position(|task| *task == episode.task);
        let task = known.unwrap_or(self.tasks.len());
        if known.is_none() {
            self.tasks.push(episode.task.clone());
        }
        let first_frame = self.frames();
        let features = features(
            episode,
            Place {
                episode: self.episodes.len(),
                first_frame,
                task,
            },
        );
        if self.kind.is_none() {
            self.kind = Some(episode.kind);
            self.described = meta::described(&features);
            self.gathered = features.iter().map(|f| f.gathered.empty()).collect();
        }
        for (all, feature) in self.gathered.iter_mut().zip(&features) {
            all.add(&feature.gathered);
        }
        let statistics = features.iter().map(|f| Statistics::of(&f.gathered));
        let statistics = statistics.collect::<Result<_>>()?;

        let texts = [("huggingface", meta::hugging_face(&features))];
        let columns: Vec<_> = features.into_iter().map(|f| f.column).collect();
        let bytes = episode.bytes();
        self.open = match self.open.take() {
            Some((table, held)) if held + bytes <= meta::FILE_MB << 20 => Some((table, held)),
            full => {
                full.map(|(table, _)| table.finish()).transpose()?;
                let path = meta::data_path(self.data.len());
                let table = Table::create(&self.folder.join(&path), &columns, &texts)?;
                self.data.push(WrittenFile {
                    path: path.into(),
                    count: 0,
                    of: "frames",
                });
                Some((table, 0))
            }
        };
        let (Some((table, held)), Some(file)) = (&mut self.open, self.data.last_mut()) else {
            bail!()
        };
        Ok(())
    }
}
