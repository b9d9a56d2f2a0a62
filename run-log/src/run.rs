//! A recorded run, from its folder or its file.

use crate::error::At;
use crate::mcap_file::{RUN_FILE, RunFilm, is_mcap, replay_bytes};
use crate::{CYCLES_FILE, Error, Result, RunLog};
use rt_controller::recording::{Item, LogReader, Read};
use shared_types::ipc::{CycleRecord, JointReport};
use std::path::{Path, PathBuf};

/// A recorded run. Everything that is told of the control cycles comes from the exact
/// recording, bit for bit.
#[derive(Debug, Clone)]
pub struct Run {
    path: PathBuf,
    recording: Vec<u8>,
}

/// What the control loop did and was told.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cycles {
    /// Control cycles in order.
    pub cycles: Vec<CycleRecord>,
    /// Joint reports as they came, each one once.
    pub joints: Vec<JointReport>,
}

impl Run {
    /// Opens a run folder, or a file `run.mcap` or `cycles.bin`.
    ///
    /// # Errors
    /// [`Error::NoRun`], [`Error::NoRecording`], or the recording cannot be read.
    pub fn open(run: &Path) -> Result<Self> {
        if !run.exists() {
            return Err(Error::NoRun(run.to_owned()));
        }
        let file = if run.is_dir() {
            // Either will do; the smaller one is read sooner.
            [CYCLES_FILE, RUN_FILE]
                .map(|name| run.join(name))
                .into_iter()
                .find(|file| file.is_file())
                .ok_or_else(|| Error::NoRecording(run.to_owned()))?
        } else {
            run.to_owned()
        };
        let mut recording = std::fs::read(&file).map_err(Error::read(&file))?;
        if is_mcap(&recording) {
            recording = replay_bytes(&recording).at(|| format!("`{}`", file.display()))?;
        }
        Ok(Self {
            path: run.to_owned(),
            recording,
        })
    }

    /// The exact recording, for [`rt_controller::recording::replay()`].
    #[must_use]
    pub fn recording(&self) -> &[u8] {
        &self.recording
    }

    /// What a person wants to know of each cycle, and every stop.
    ///
    /// # Errors
    /// The recording holds nothing this version can read.
    pub fn log(&self) -> Result<RunLog> {
        RunLog::read(&self.recording).at(|| format!("`{}`", self.path.display()))
    }

    /// Control cycles and joint reports.
    ///
    /// # Errors
    /// The recording holds nothing this version can read.
    pub fn cycles(&self) -> Result<Cycles> {
        let items = LogReader::open(&self.recording).at(|| format!("`{}`", self.path.display()))?;
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

    /// The pictures, the camera and the measured joints in a run's file.
    ///
    /// # Errors
    /// The file cannot be read, or is not as this program writes it.
    pub fn film(file: &Path) -> Result<RunFilm> {
        RunFilm::read(file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rt_controller::recording::{ChunkWriter, RecordedCycle};

    /// Cycles with a joint report in every second one.
    fn recording() -> (Vec<u8>, Cycles) {
        let (mut writer, mut bytes) = (ChunkWriter::default(), Vec::new());
        let mut told = Cycles::default();
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
                told.joints.push(report);
            }
            told.cycles.push(one.record);
            bytes.extend(writer.cycle(&one).unwrap_or_default());
        }
        bytes.extend(writer.flush().unwrap_or_default());
        (bytes, told)
    }

    #[test]
    fn cycles_and_reports_come_back_bit_for_bit() {
        let (bytes, told) = recording();
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(CYCLES_FILE), &bytes).unwrap();
        let run = Run::open(folder.path()).unwrap();
        assert_eq!(run.recording(), bytes);
        assert_eq!(run.cycles().unwrap(), told);
    }

    #[test]
    fn what_is_no_run_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let none = folder.path().join("none");
        assert!(matches!(Run::open(&none), Err(Error::NoRun(path)) if path == none));
        assert!(matches!(
            Run::open(folder.path()),
            Err(Error::NoRecording(_))
        ));
        let words = folder.path().join("words");
        std::fs::write(&words, "t,q1\n0,1\n").unwrap();
        let error = Run::open(&words).unwrap().cycles().unwrap_err();
        assert!(error.to_string().contains("words"), "{error}");
    }

    /// A recording with bytes changed is read as far as it is whole, or refused.
    #[test]
    fn damage_costs_chunks_and_never_invents_cycles() {
        let (bytes, told) = recording();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(CYCLES_FILE);
        for k in 0..200_usize {
            let mut bytes = bytes.clone();
            let at = (k * 2_654_435_761) % bytes.len();
            bytes[at] ^= 1 << (k % 8);
            std::fs::write(&path, &bytes).unwrap();
            let Ok(found) = Run::open(folder.path()).unwrap().cycles() else {
                continue;
            };
            assert!(found.cycles.iter().all(|c| told.cycles.contains(c)));
            assert!(found.joints.iter().all(|r| told.joints.contains(r)));
        }
    }
}
