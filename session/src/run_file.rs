//! The process that records the run as one file. When it dies no motion is stopped, but
//! the exact record of the cycles ends there; the command says so at once, and fails.

use super::{ProcessSpec, Supervisor};
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long it may take to begin.
const BEGIN: Duration = Duration::from_secs(10);
/// How long it may take to simulate the rope and to write the end of the file.
const FINISH: Duration = Duration::from_secs(20);

/// What became of a run whose recorder died, and what helps.
pub fn remedy(file: &Path) -> String {
    let path = file.display();
    format!(
        "the run is kept, but its file `{path}` is not whole; make room if the disk is full, then `wag record recover {path}` repairs it as far as it goes"
    )
}

#[derive(Debug)]
pub(crate) struct RunFile {
    process: Supervisor,
    path: PathBuf,
    lost: Option<anyhow::Error>,
}

impl RunFile {
    /// Starts the process and waits until nothing can be missed any more. When it
    /// cannot be had, that is known at once and reported at the end.
    pub(crate) fn start(spec: &ProcessSpec, path: &Path, log_folder: &Path) -> Self {
        let mut file = Self {
            process: Supervisor::default(),
            path: path.to_owned(),
            lost: None,
        };
        if let Err(reason) = file.begin(spec, log_folder) {
            file.lose(reason);
        }
        file
    }

    fn begin(&mut self, spec: &ProcessSpec, log_folder: &Path) -> anyhow::Result<()> {
        self.process.start(spec, log_folder)?;
        let began = Instant::now();
        while !self.path.exists() {
            self.process.check()?;
            if began.elapsed() > BEGIN {
                bail!(
                    "the {} process did not begin within {} s",
                    spec.name,
                    BEGIN.as_secs()
                );
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        Ok(())
    }

    fn lose(&mut self, reason: anyhow::Error) {
        eprintln!(
            "warning: the run continues, but `{}` will be incomplete: {reason:#}",
            self.path.display()
        );
        self.lost = Some(reason);
    }

    /// Looks whether the process still lives.
    pub(crate) fn watch(&mut self) {
        if self.lost.is_none()
            && let Err(reason) = self.process.check()
        {
            self.lose(reason);
        }
    }

    /// Lets the process finish the file, once all results lie in the run folder.
    pub(crate) fn finish(mut self) -> anyhow::Result<()> {
        let ended = self.process.finish(FINISH);
        let ended = self.lost.take().map_or(ended, Err);
        ended.with_context(|| remedy(&self.path))
    }
}

impl Drop for RunFile {
    fn drop(&mut self) {
        // A run that failed has said so; its file is finished all the same.
        let _ = self.process.finish(FINISH);
    }
}
