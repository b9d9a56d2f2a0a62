//! The recorder as a thread, for a command that does nothing but record.

use super::recorder::{Recorded, RecorderConfig, listen};
use anyhow::{Context, Result, bail};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

/// Pause between two looks whether it has begun.
const LOOK: Duration = Duration::from_millis(5);

/// A recording under way; dropping it ends it.
#[derive(Debug)]
pub struct RunFileThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<Recorded>>>,
}

impl RunFileThread {
    /// Begins to record. Returns when nothing can be missed any more.
    ///
    /// # Errors
    /// Shared memory cannot be joined or the file cannot be written.
    pub fn start(config: RecorderConfig) -> Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = Arc::clone(&stop);
        let file = config.file.clone();
        let thread = std::thread::Builder::new()
            .name("run-file".to_owned())
            .spawn(move || listen(&config, &stopped))
            .context("cannot start the recording thread")?;
        while !file.exists() && !thread.is_finished() {
            std::thread::sleep(LOOK);
        }
        let started = Self {
            stop,
            thread: Some(thread),
        };
        // The file appears once everything is connected; without it there is a reason.
        if file.exists() {
            Ok(started)
        } else {
            started.stop()?;
            bail!("the recording of `{}` ended at once", file.display());
        }
    }

    /// Whether it has ended by itself, which only an error makes it do.
    pub fn has_died(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Ends the recording once everything that has come is written.
    ///
    /// # Errors
    /// The file could not be written; what is in it can be recovered.
    pub fn stop(mut self) -> Result<Recorded> {
        self.stop.store(true, Ordering::SeqCst);
        let ended = self.thread.take().map(JoinHandle::join);
        ended
            .and_then(std::thread::Result::ok)
            .context("the recording thread broke down")?
    }
}

impl Drop for RunFileThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        // Whoever drops it does not ask what became of it.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}
