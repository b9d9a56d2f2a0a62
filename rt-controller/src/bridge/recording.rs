//! Hands all inputs and outputs of the core to whoever records them.

use crate::recording::ChunkWriter;
use crate::recording::chunk::CHUNK_MAX;
use shared_types::ipc::{Bus, ChunkPublisher, IpcError};

/// Packs chunks and publishes them. A chunk that cannot be sent is counted and
/// dropped: its number is missing in the recording.
#[derive(Debug)]
pub(super) struct RecordingFeed {
    pub(super) writer: ChunkWriter,
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

    /// Adds to the recording, and sends the chunk that ends with it, if one does.
    pub(super) fn add(&mut self, add: impl FnOnce(&mut ChunkWriter) -> Option<&[u8]>) {
        let Some(chunk) = add(&mut self.writer) else {
            return;
        };
        let sent = self
            .publisher
            .loan_slice_uninit(chunk.len())
            .map_err(|e| format!("{e:?}"))
            .and_then(|sample| {
                sample
                    .write_from_slice(chunk)
                    .send()
                    .map_err(|e| format!("{e:?}"))
            });
        if let Err(reason) = sent {
            self.unsent += 1;
            // Once is enough; the gap in the recording tells how many.
            if self.unsent == 1 {
                tracing::warn!(%reason, "a chunk of the recording could not be sent");
            }
        }
    }
}
