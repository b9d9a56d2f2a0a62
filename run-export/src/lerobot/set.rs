//! A data set under way: episodes come one after the other, what the set tells of itself last.

use super::columns::{Column, Table};
use super::data::DataFiles;
use super::episode::{Episode, Kind};
use super::features::{FeatureValues, Place, features};
use super::meta::{self, EpisodeMeta, Statistics};
use crate::written::{Written, WrittenFile};
use anyhow::{Context, Result, ensure};
use run_log::files;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// File of a set by which an export knows an earlier one; the library leaves it alone.
const MARK: &str = "meta/wag.json";
/// Whether a folder holds a set as it was exported: the files that were written, of the sizes
/// that they had, and nothing beside them. Others may have added episodes, which must not be lost.
pub(super) fn is_set(folder: &Path) -> bool {
    let is_folder = folder.symlink_metadata().is_ok_and(|found| found.is_dir());
    let as_written = || {
        let mut found = sizes(folder).ok()?;
        found.remove(MARK)?;
        let mark: Value = serde_json::from_slice(&fs::read(folder.join(MARK)).ok()?).ok()?;
        Some(mark["files"] == json!(found))
    };
    is_folder && as_written().unwrap_or(false)
}

/// Size of every file below a folder (bytes), by its path from there on.
///
/// # Errors
/// It cannot be read, or there is something else than files and folders, which no export has.
fn sizes(folder: &Path) -> io::Result<BTreeMap<String, u64>> {
    let mut sizes = BTreeMap::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        // That of a link itself, which is not followed.
        let kind = entry.file_type()?;
        let name = entry.file_name();
        let name = name.to_str().ok_or(io::ErrorKind::InvalidData)?;
        if kind.is_dir() {
            let below = self::sizes(&entry.path())?.into_iter();
            sizes.extend(below.map(|(path, bytes)| (format!("{name}/{path}"), bytes)));
        } else if kind.is_file() {
            sizes.insert(name.to_owned(), entry.metadata()?.len());
        } else {
            return Err(io::ErrorKind::InvalidData.into());
        }
    }
    Ok(sizes)
}

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
    gathered: Vec<FeatureValues>,
    episodes: Vec<EpisodeMeta>,
    /// What is done in the episodes, each once.
    tasks: Vec<String>,
    data: DataFiles,
    /// Frames that show the same picture as the frame before.
    repeats: usize,
    missing: Vec<String>,
}

impl Set {
    /// One without episodes.
    pub(super) fn new(folder: PathBuf) -> Self {
        Self {
            data: DataFiles::new(folder.clone()),
            folder,
            runs: Vec::new(),
            kind: None,
            described: Value::Null,
            gathered: Vec::new(),
            episodes: Vec::new(),
            tasks: Vec::new(),
            repeats: 0,
            missing: Vec::new(),
        }
    }

    /// Refuses an episode that is not like the first.
    ///
    /// # Errors
    /// Names both runs and what each is like.
    pub(super) fn check(&self, episode: &Episode) -> Result<()> {
        let (Some(kind), Some(first)) = (self.kind, self.runs.first()) else {
            return Ok(());
        };
        ensure!(
            episode.kind == kind,
            "the runs of a data set must be alike, but `{}` has {kind}, and `{}` has {}: export \
             them apart, or, where only their rates differ, name one with --fps",
            first.display(),
            episode.run.display(),
            episode.kind
        );
        Ok(())
    }

    /// Adds an episode.
    pub(super) fn add(&mut self, episode: &Episode) -> Result<()> {
        let known = self.tasks.iter().position(|task| *task == episode.task);
        let task = known.unwrap_or(self.tasks.len());
        if known.is_none() {
            self.tasks.push(episode.task.clone());
        }
        let place = Place {
            episode: self.episodes.len(),
            first_frame: self.frames(),
            task,
        };
        let features = features(episode, place);
        let statistics = features.iter().map(|f| Statistics::of(&f.gathered));
        let statistics = statistics.collect::<Result<_>>()?;
        if self.kind.is_none() {
            self.kind = Some(episode.kind);
            self.described = meta::described(&features);
            self.gathered = features.iter().map(|f| f.gathered.clone()).collect();
        } else {
            for (all, feature) in self.gathered.iter_mut().zip(&features) {
                all.add(&feature.gathered);
            }
        }
        let texts = [("huggingface", meta::hugging_face(&features))];
        let columns: Vec<Column> = features.into_iter().map(|f| f.column).collect();
        let size = [episode.frames, episode.bytes()];
        self.episodes.push(EpisodeMeta {
            task,
            file: self.data.add(&columns, &texts, size)?,
            first_frame: place.first_frame,
            frames: episode.frames,
            statistics,
        });
        self.runs.push(episode.run.clone());
        self.repeats += episode.repeats;
        self.missing.extend_from_slice(&episode.missing);
        Ok(())
    }

    /// Frames so far.
    fn frames(&self) -> usize {
        let last = self.episodes.last();
        last.map_or(0, |told| told.first_frame + told.frames)
    }

    /// Writes what the set tells of itself; `out` is where its folder will be.
    pub(super) fn finish(self, out: &Path) -> Result<Written> {
        let (totals, kind) = (
            [self.episodes.len(), self.frames(), self.tasks.len()],
            self.kind.context("a data set needs a run")?,
        );
        let at = |path: &str| self.folder.join(path);
        let (tasks, index) = meta::tasks(&self.tasks);
        table(&at("meta/tasks.parquet"), &tasks, &[("pandas", index)])?;
        let episodes = meta::episodes(&self.episodes, &self.tasks);
        table(&at(meta::EPISODES), &episodes, &[])?;
        let statistics = self.gathered.iter().map(Statistics::of);
        let statistics = statistics.collect::<Result<Vec<_>>>()?;
        files::write_json(&at("meta/stats.json"), &meta::stats(&statistics))?;
        let info = meta::info(kind, &self.described, totals);
        files::write_json(&at("meta/info.json"), &info)?;
        let data = self.data.finish()?.into_iter();
        // All other files are complete now.
        let runs: Vec<_> = self.runs.iter().map(|run| run.to_string_lossy()).collect();
        let sizes = sizes(&self.folder)?;
        let mark = json!({ "version": shared_types::VERSION, "runs": runs, "files": sizes });
        files::write_json(&at(MARK), &mark)?;

        let data = data.map(|file| WrittenFile {
            path: out.join(file.path),
            ..file
        });
        let figures = json!({
            "runs": self.runs, "folder": out, "fps": kind.fps, "episodes": totals[0],
            "frames": totals[1], "repeated_pictures": self.repeats, "tasks": self.tasks,
        });
        Ok(Written {
            run: self.runs.into_iter().next().unwrap_or_default(),
            files: data.collect(),
            figures,
            missing: self.missing,
        })
    }
}

/// A file of one piece.
fn table(path: &Path, columns: &[Column], texts: &[(&str, String)]) -> Result<()> {
    let mut table = Table::create(path, columns, texts)?;
    table.add(columns)?;
    table.finish()
}
