//! The thread that writes a recording.

use crate::chunk_file::{ChunkFile, WriteCounts};
use crate::{Error, Result};
use shared_types::ipc::{Bus, ChunkSubscriber};
use std::fs::File;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread::JoinHandle;
use std::time::Duration;

/// Pause between two looks for chunks; ten come in a second.
const TURN: Duration = Duration::from_millis(20);

/// What became of a recording.
pub type RecordingReport = WriteCounts;

/// A recording under way; dropping it ends it.
#[derive(Debug)]
pub struct RecordingThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<RecordingReport>>,
}

impl RecordingThread {
    /// Begins to record what the controller of `domain` publishes, now or later.
    /// Returns when nothing can be missed any more.
    ///
    /// # Errors
    /// The file cannot be written, or shared memory cannot be joined.
    pub fn start(domain: &str, path: &Path) -> Result<Self> {
        let file = File::options()
            .write(true)
            .create_new(true)
            .open(path)
            .map_err(Error::write(path))?;
        let stop = Arc::new(AtomicBool::new(false));
        let (ready, wait) = mpsc::channel();
        let (domain, stopped) = (domain.to_owned(), Arc::clone(&stop));
        let body = move || {
            // Connections to shared memory stay in the thread that made them.
            let opened = Bus::join(&domain).and_then(|bus| Ok((bus.chunk_subscriber()?, bus)));
            match opened {
                Ok((chunks, bus)) => {
                    let _ = ready.send(Ok(()));
                    let report = write(&chunks, file, &stopped);
                    drop((chunks, bus));
                    report
                }
                Err(error) => {
                    let _ = ready.send(Err(error));
                    RecordingReport::default()
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("recording".to_owned())
            .spawn(body)
            .map_err(|reason| {
                Error::Recorder(format!("cannot start the recording thread: {reason}"))
            })?;
        wait.recv()
            .map_err(|_gone| Error::Recorder("the recording thread ended at once".to_owned()))??;
        Ok(Self {
            stop,
            thread: Some(thread),
        })
    }

    /// Ends the recording once everything that has come is written.
    pub fn finish(mut self) -> RecordingReport {
        self.end()
    }

    fn end(&mut self) -> RecordingReport {
        self.stop.store(true, Ordering::SeqCst);
        self.thread
            .take()
            .and_then(|thread| thread.join().ok())
            .unwrap_or_default()
    }
}

impl Drop for RecordingThread {
    fn drop(&mut self) {
        self.end();
    }
}

fn write(chunks: &ChunkSubscriber, file: File, stop: &AtomicBool) -> RecordingReport {
    let mut file = ChunkFile::new(file);
    loop {
        // Looked at before draining: what came before the wish to stop is kept.
        let last = stop.load(Ordering::SeqCst);
        loop {
            match chunks.receive() {
                Ok(Some(sample)) => file.put(&sample),
                Ok(None) => break,
                Err(reason) => {
                    tracing::warn!(?reason, "the recording lost its connection");
                    break;
                }
            }
        }
        if last {
            return file.counts;
        }
        std::thread::sleep(TURN);
    }
}
