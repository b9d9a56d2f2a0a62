//! Hands all inputs and outputs of the core to whoever records them.

use crate::control::Motion;
use crate::recording::chunk::CHUNK_MAX;
use crate::recording::{ChunkWriter, RecordedCycle, Snapshot};
use shared_types::ipc::{Bus, CauseRecord, ChunkPublisher, IpcError};

/// Packs chunks and publishes them. A chunk that cannot be sent is counted and
/// dropped: its number is missing in the recording.
#[derive(Debug)]
pub(super) struct RecordingFeed {
    writer: ChunkWriter,
    publisher: ChunkPublisher,
    unsent: u64,
}

impl RecordingFeed {
    pub(super) fn open(bus: &Bus) -> Result<Self, IpcError> {
        Ok(Self {
            writer: ChunkWriter::default(),
            publisher: bus.chunk_publisher(CHUNK_MAX)?,
            unsent: 0,
        })
    }

    /// A motion is about to be commanded.
    pub(super) fn motion(&mut self, id: u64, motion: &Motion) {
        self.writer.motion(id, motion);
    }

    /// The arm was stopped.
    pub(super) fn cause(&mut self, cause: &CauseRecord) {
        self.writer.cause(cause);
    }

    /// The state before the next cycle.
    pub(super) fn state(&mut self, snapshot: &Snapshot) {
        let chunk = self.writer.keyframe(snapshot);
        Self::send(&self.publisher, chunk, &mut self.unsent);
    }

    /// A cycle.
    pub(super) fn cycle(&mut self, cycle: &RecordedCycle) {
        let chunk = self.writer.cycle(cycle);
        Self::send(&self.publisher, chunk, &mut self.unsent);
    }

    /// Sends what has been collected so far.
    pub(super) fn flush(&mut self) {
        let chunk = self.writer.flush();
        Self::send(&self.publisher, chunk, &mut self.unsent);
    }

    fn send(publisher: &ChunkPublisher, chunk: Option<&[u8]>, unsent: &mut u64) {
        let Some(chunk) = chunk else {
            return;
        };
        let sent = publisher
            .loan_slice_uninit(chunk.len())
            .map_err(|e| format!("{e:?}"))
            .and_then(|sample| {
                sample
                    .write_from_slice(chunk)
                    .send()
                    .map_err(|e| format!("{e:?}"))
            });
        if let Err(reason) = sent {
            *unsent += 1;
            // Once is enough; the gap in the recording tells how many.
            if *unsent == 1 {
                tracing::warn!(%reason, "a chunk of the recording could not be sent");
            }
        }
    }
}
