//! A recorded run, from its folder or its file.

use crate::files::cannot_read;
use crate::mcap_file::{RunFilm, Walked, is_mcap, messages, replay_bytes, walk};
use crate::{Channel, CommandLine, Cycles, Explanation, RunLog, explain, files};
use anyhow::{Context, Result, bail, ensure};
use arm_model::Cell;
use mcap::records::Record;
use rt_controller::recording::{Item, LogReader, Read};
use serde_json::Value;
use shared_types::{KeypointTrack, Plan, RopeParams};
use std::path::{Path, PathBuf};

/// A run. What a folder does not hold is `None`; what it holds and is damaged is an error
/// that names the file.
#[derive(Debug, Clone)]
pub struct Run {
    folder: PathBuf,
    recorded: Option<PathBuf>,
    film: PathBuf,
}

/// The cell to look at runs in: what is named goes first, then what a run tells itself,
/// then what holds here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellHere {
    /// The cell that holds here.
    pub cell: Cell,
    /// Whether it was named on the command line.
    pub is_named: bool,
}

impl CellHere {
    /// The cell of a run whose folder tells `reported`.
    pub fn of_run(&self, reported: Option<Cell>) -> Cell {
        reported.filter(|_| !self.is_named).unwrap_or(self.cell)
    }
}

/// The folder of a file, which may be the current one.
fn parent_of(file: &Path) -> PathBuf {
    let parent = file.parent().filter(|p| !p.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_owned()
}

/// A folder or a file without a recording.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` is not a run folder or file with recorded control cycles: {} (of older versions {}) \
     is not there, or the run ended or its recorder died before the controller's first cycle",
    .0.display(), files::RUN, files::CYCLES
)]
pub struct NoRecording(pub PathBuf);

/// The exact recording of a run's control cycles; read, it fails where it holds nothing
/// that this version knows.
#[derive(Debug, Clone)]
pub struct Recording {
    path: PathBuf,
    bytes: Vec<u8>,
}

impl Run {
    /// Opens a run folder, or a file `run.mcap` or `cycles.bin` (of a version that wrote
    /// the cycles apart). Fails where there is none.
    pub fn open(run: &Path) -> Result<Self> {
        ensure!(
            run.exists(),
            "`{}` does not exist; name a run folder as made by wag run, demo, throw, wiggle or record",
            run.display()
        );
        if run.is_dir() {
            // Where there are both, the smaller one is read sooner.
            let files = [files::CYCLES, files::RUN].map(|name| run.join(name));
            return Ok(Self {
                folder: run.to_owned(),
                recorded: files.into_iter().find(|file| file.is_file()),
                film: run.join(files::RUN),
            });
        }
        Ok(Self {
            folder: parent_of(run),
            recorded: Some(run.to_owned()),
            film: run.to_owned(),
        })
    }

    /// The run's folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The exact recording; [`NoRecording`] where there is none.
    pub fn recording(&self) -> Result<Recording> {
        let path = self.recorded.clone();
        let path = path.ok_or_else(|| NoRecording(self.folder.clone()))?;
        let mut bytes = std::fs::read(&path).map_err(cannot_read(&path))?;
        let of_mcap = is_mcap(&bytes);
        if of_mcap {
            bytes = replay_bytes(&bytes).with_context(|| format!("`{}`", path.display()))?;
        }
        let is_named = path.extension().is_some_and(|e| e == "mcap" || e == "bin");
        ensure!(
            of_mcap || is_named,
            "`{}` is not a recording; name a run folder, or its file `{}`",
            path.display(),
            files::RUN
        );
        // On a full disk the recorder leaves its file without a byte.
        if bytes.is_empty() && (of_mcap || path.ends_with(files::RUN)) {
            bail!(NoRecording(path));
        }
        Ok(Recording { path, bytes })
    }

    /// The pictures, the camera and the measured joints in the run's file.
    pub fn film(&self) -> Result<RunFilm> {
        RunFilm::read(&self.film)
    }

    /// Hands every message of the run's file to `each` in the order of the file, with its time
    /// (wall clock, ns), as they were given to [`crate::McapFile`]; what is missing of the file,
    /// in words.
    ///
    /// # Errors
    /// The file cannot be read, is no MCAP file, or `each` fails.
    pub fn messages(
        &self,
        each: impl FnMut(Channel, u64, &[u8]) -> Result<()>,
    ) -> Result<Vec<String>> {
        self.read_file(|bytes| messages(bytes, each))
    }

    /// Hands schemas, channels, messages, attachments and metadata of the run's file to `each` in
    /// the order of the file; what is missing of the file, in words.
    ///
    /// # Errors
    /// The file cannot be read, is no MCAP file, or `each` fails.
    pub fn records(&self, each: impl FnMut(&Record<'_>) -> Result<()>) -> Result<Vec<String>> {
        self.read_file(|bytes| walk(bytes, each))
    }

    fn read_file(&self, walk: impl FnOnce(&[u8]) -> Result<Walked>) -> Result<Vec<String>> {
        let fail = || format!("run file `{}`", self.film.display());
        let bytes = std::fs::read(&self.film).map_err(cannot_read(&self.film));
        let walked = walk(&bytes.with_context(fail)?).with_context(fail)?;
        Ok(Self::flaws_of(&walked))
    }

    /// What is missing of the run's file, in words; nothing of one that an older version wrote.
    ///
    /// # Errors
    /// The file is there and cannot be read.
    pub fn flaws(&self) -> Result<Vec<String>> {
        if !self.film.is_file() {
            return Ok(Vec::new());
        }
        let bytes = std::fs::read(&self.film).map_err(cannot_read(&self.film))?;
        if is_mcap(&bytes) {
            Ok(Self::flaws_of(&walk(&bytes, |_| Ok(()))?))
        } else {
            Ok(Vec::new())
        }
    }

    fn flaws_of(walked: &Walked) -> Vec<String> {
        let damaged = format!("{} damaged chunks of its file", walked.damaged_chunks);
        let flaws = [
            (walked.damaged_chunks > 0, damaged),
            (
                !walked.whole,
                "the end of its file, which breaks off".to_owned(),
            ),
        ];
        let told = flaws.into_iter().filter(|(holds, _)| *holds);
        told.map(|(_, words)| words).collect()
    }

    /// A file of the folder, read by `read` where it is there.
    fn file<T>(&self, name: &str, read: impl FnOnce(&Path) -> Result<T>) -> Result<Option<T>> {
        let path = self.folder.join(name);
        path.is_file().then(|| read(&path)).transpose()
    }

    /// How it was made.
    pub fn command(&self) -> Result<Option<CommandLine>> {
        self.file(files::COMMAND, files::read_json)
    }

    /// Every figure of it.
    pub fn summary(&self) -> Result<Option<Value>> {
        self.file(files::SUMMARY, files::read_json)
    }

    /// When the film began that the times of its other files count from (CLOCK_MONOTONIC, ns);
    /// none of a run without a film.
    ///
    /// # Errors
    /// Its summary cannot be read.
    pub fn epoch_ns(&self) -> Result<Option<u64>> {
        let summary = self.summary()?.unwrap_or_default();
        Ok(summary["epoch_ns"].as_u64().filter(|ns| *ns > 0))
    }

    /// The figures of a run that threw.
    ///
    /// # Errors
    /// It has none, or no plan of a throw, or ended before its throw did.
    pub fn summary_of_throw(&self) -> Result<Value> {
        let name = self.folder.display();
        let not_a_throw = |file| format!("`{name}` is not the folder of a throw: it lacks {file}");
        self.plan()?.with_context(|| not_a_throw(files::PLAN))?;
        let summary = self.summary()?.filter(Value::is_object);
        let summary = summary.with_context(|| not_a_throw(files::SUMMARY))?;
        ensure!(
            summary["ok"] != false,
            "`{name}` ended with an error ({}): name another run, or, if it threw all the same, \
             its plan.json and the miss to `wag plan again`",
            summary["error"]
                .as_str()
                .unwrap_or("of which nothing is kept")
        );
        Ok(summary)
    }

    /// The film of its throw, both images, which it has where it was to keep its films.
    pub fn throw_film(&self) -> Result<PathBuf> {
        let prefix = format!("{}_", files::THROW_FILM);
        let is_film = |path: &PathBuf| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(&prefix) && name.ends_with(".yuyv")
        };
        let listed = std::fs::read_dir(&self.folder).map_err(cannot_read(&self.folder))?;
        let paths = listed.filter_map(|entry| Some(entry.ok()?.path()));
        paths.filter(is_film).min().with_context(|| {
            format!(
                "`{}` holds no film of its throw, as `wag run --keep-films` keeps it: name one with --video",
                self.folder.display()
            )
        })
    }

    /// The cell it ran in; runs of older versions do not tell it.
    pub fn cell(&self) -> Result<Option<Cell>> {
        self.file(files::CELL, files::read_cell)
    }

    /// The rope's keypoints in the film of its wiggle.
    pub fn keypoints(&self) -> Result<Option<KeypointTrack>> {
        self.file(files::KEYPOINTS, |path| {
            let track: KeypointTrack = files::read_json(path)?;
            let fail = || format!("keypoints `{}`", path.display());
            track.validate().with_context(fail)?;
            Ok(track)
        })
    }

    /// The identified rope.
    pub fn rope(&self) -> Result<Option<RopeParams>> {
        self.file(files::ROPE, files::read_rope)
    }

    /// The plan of the throw; one that was changed after it was planned is damaged.
    pub fn plan(&self) -> Result<Option<Plan>> {
        self.file(files::PLAN, files::read_plan)
    }

    /// Why it was stopped, as it was kept.
    pub fn cause(&self) -> Result<Option<Value>> {
        self.file(files::CAUSE, files::read_json)
    }

    /// Explains the recording of the run and keeps the explanation as `cause.json` when the
    /// arm was stopped. `None` when there is no recording to explain; that never spoils the
    /// run itself.
    pub fn keep_cause(&self) -> Option<Explanation> {
        let found = explain(&self.recording().ok()?.log().ok()?);
        if found.stopped
            && let Err(reason) = files::write_json(&self.folder.join(files::CAUSE), &found)
        {
            tracing::warn!(%reason, "the cause of the stop could not be kept");
        }
        Some(found)
    }
}

impl Recording {
    /// Its bytes, for [`rt_controller::recording::replay()`].
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// What a person wants to know of each cycle, and every stop.
    pub fn log(&self) -> Result<RunLog> {
        RunLog::read(&self.bytes).with_context(|| format!("`{}`", self.path.display()))
    }

    /// Control cycles and joint reports, bit for bit.
    pub fn cycles(&self) -> Result<Cycles> {
        let items =
            LogReader::open(&self.bytes).with_context(|| format!("`{}`", self.path.display()))?;
        let mut found = Cycles::default();
        for read in items {
            if let Read::Item(Item::Cycle(cycle)) = read {
                found.cycles.push(cycle.record);
                found
                    .joints
                    .extend_from_slice(cycle.input.reports.as_slice());
            }
        }
        Ok(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rt_controller::recording::{ChunkWriter, RecordedCycle};
    use shared_types::ipc::JointReport;

    /// Cycles with a joint report in every second one.
    fn recording() -> (Vec<u8>, Cycles) {
        let (mut writer, mut bytes) = (ChunkWriter::default(), Vec::new());
        let mut reported = Cycles::default();
        for cycle in 1..=60 {
            let mut one = RecordedCycle::default();
            one.input.cycle = cycle;
            one.record.cycle = cycle;
            one.record.deadline_ns = cycle * 4_000_000;
            one.record.q_c[3] = 1.0 / cycle as f64;
            if cycle % 2 == 0 {
                let mut report = JointReport {
                    stamp_ns: cycle * 4_000_000 - 1_234_567,
                    arm_clock: 1,
                    ..JointReport::default()
                };
                report.q[6] = 0.1 * cycle as f64;
                report.q_target[6] = 0.3 / cycle as f64;
                one.input.reports.push(report);
                reported.joints.push(report);
            }
            reported.cycles.push(one.record);
            bytes.extend(writer.cycle(&one).unwrap_or_default());
        }
        bytes.extend(writer.flush().unwrap_or_default());
        (bytes, reported)
    }

    #[test]
    fn cycles_and_reports_come_back_bit_for_bit() {
        let (bytes, reported) = recording();
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(files::CYCLES), &bytes).unwrap();
        let found = Run::open(folder.path()).unwrap().recording().unwrap();
        assert_eq!(found.bytes(), bytes);
        assert_eq!(found.cycles().unwrap(), reported);
    }

    /// A recording with bytes changed is read as far as it is whole, or refused.
    #[test]
    fn damage_costs_chunks_and_never_invents_cycles() {
        let (bytes, reported) = recording();
        for k in 0..200_usize {
            let mut bytes = bytes.clone();
            let at = (k * 2_654_435_761) % bytes.len();
            bytes[at] ^= 1 << (k % 8);
            let path = PathBuf::from("changed");
            let Ok(found) = (Recording { path, bytes }).cycles() else {
                continue;
            };
            assert!(found.cycles.iter().all(|c| reported.cycles.contains(c)));
            assert!(found.joints.iter().all(|r| reported.joints.contains(r)));
        }
    }
}
