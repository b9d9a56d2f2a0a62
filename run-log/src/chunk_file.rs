//! Chunks into a file: whole ones only, whatever the disk does.

use rt_controller::recording::chunk::{self, Front};
use serde::Serialize;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};

/// What became of the chunks.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct WriteCounts {
    /// Chunks in the file.
    pub chunks: u64,
    /// Bytes in the file.
    pub bytes: u64,
    /// Chunks that never came here: this thread or the controller's bridge was too
    /// slow.
    pub lost_chunks: u64,
    /// Chunks that the disk did not take.
    pub unwritten_chunks: u64,
    /// Why it did not take the first of them.
    pub disk_error: Option<String>,
}

/// A file that grows by whole chunks, from the first keyframe on.
#[derive(Debug)]
pub(crate) struct ChunkFile {
    file: File,
    next_sequence: Option<u32>,
    /// What became of the chunks so far.
    pub counts: WriteCounts,
}

impl ChunkFile {
    /// Appends to an empty file.
    pub(crate) fn new(file: File) -> Self {
        Self {
            file,
            next_sequence: None,
            counts: WriteCounts::default(),
        }
    }

    /// Appends a chunk. What cannot be written is counted.
    pub(crate) fn put(&mut self, bytes: &[u8]) {
        let Front::Chunk { header, .. } = chunk::read(bytes) else {
            self.counts.lost_chunks += 1;
            return;
        };
        if self.next_sequence.is_none() && !header.keyframe {
            return;
        }
        let expected = self.next_sequence.unwrap_or(header.sequence);
        self.next_sequence = Some(header.sequence.wrapping_add(1));
        // A controller that starts anew counts from zero again.
        if header.sequence != 0 {
            self.counts.lost_chunks += u64::from(header.sequence.wrapping_sub(expected));
        }
        match self.file.write_all(bytes) {
            Ok(()) => {
                self.counts.chunks += 1;
                self.counts.bytes += bytes.len() as u64;
            }
            Err(reason) => {
                self.counts.unwritten_chunks += 1;
                self.counts
                    .disk_error
                    .get_or_insert_with(|| reason.to_string());
                // Takes back a part of a chunk, so that the next one can follow.
                let _ = self.file.set_len(self.counts.bytes);
                let _ = self.file.seek(SeekFrom::Start(self.counts.bytes));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(keyframe: bool, sequence: u32) -> Vec<u8> {
        let mut out = Vec::new();
        chunk::write(&mut out, keyframe, sequence, 0, b"items");
        out
    }

    #[test]
    fn the_file_begins_with_a_keyframe_and_losses_are_counted() {
        let mut file = ChunkFile::new(tempfile::tempfile().unwrap());
        for (keyframe, sequence) in [(false, 3), (true, 4), (false, 5), (false, 8), (true, 0)] {
            file.put(&chunk(keyframe, sequence));
        }
        assert_eq!(file.counts.chunks, 4);
        assert_eq!(file.counts.lost_chunks, 2);
        assert_eq!(file.counts.bytes, 4 * chunk(true, 4).len() as u64);
        assert_eq!(file.counts.disk_error, None);
    }

    /// `/dev/full` answers every write like a full disk.
    #[test]
    fn a_full_disk_is_counted_and_reported() {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut file = ChunkFile::new(full);
        for sequence in 0..5 {
            file.put(&chunk(true, sequence));
        }
        assert_eq!((file.counts.chunks, file.counts.unwritten_chunks), (0, 5));
        let error = file.counts.disk_error.unwrap();
        assert!(error.contains("No space left"), "{error}");
    }
}
