//! What is lost on the way, and what became of the exact recording.

use rt_controller::recording::chunk::{self, Front};
use serde::Serialize;

/// Numbers that should follow each other.
#[derive(Debug, Default)]
pub(super) struct Gaps {
    /// The one that comes next, after the first.
    pub next: Option<u64>,
    /// How many never came.
    pub lost: u64,
}

impl Gaps {
    /// Takes in a number.
    pub(super) fn count(&mut self, number: u64) {
        self.lost += number.saturating_sub(self.next.unwrap_or(number));
        self.next = Some(number + 1);
    }
}

/// What became of the exact recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct RecordingCounts {
    /// Chunks in the file, from the first keyframe on.
    pub chunks: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Chunks that never came here: the recorder or the controller's bridge was too slow.
    pub lost_chunks: u64,
    #[serde(skip)]
    next_sequence: Option<u32>,
}

impl RecordingCounts {
    /// Counts a chunk.
    pub(super) fn count(&mut self, bytes: &[u8]) {
        let Front::Chunk { header, .. } = chunk::read(bytes) else {
            self.lost_chunks += 1;
            return;
        };
        if self.next_sequence.is_none() && !header.keyframe {
            return;
        }
        let expected = self.next_sequence.unwrap_or(header.sequence);
        self.next_sequence = Some(header.sequence.wrapping_add(1));
        // A controller that starts anew counts from zero again.
        if header.sequence != 0 {
            self.lost_chunks += u64::from(header.sequence.wrapping_sub(expected));
        }
        self.chunks += 1;
        self.bytes += bytes.len() as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_recording_begins_with_a_keyframe_and_losses_are_counted() {
        let chunk = |keyframe: bool, sequence: u32| {
            let mut out = Vec::new();
            chunk::write(&mut out, keyframe, sequence, 0, b"items");
            out
        };
        let mut counts = RecordingCounts::default();
        for (keyframe, sequence) in [(false, 3), (true, 4), (false, 5), (false, 8), (true, 0)] {
            counts.count(&chunk(keyframe, sequence));
        }
        assert_eq!((counts.chunks, counts.lost_chunks), (4, 2));
        assert_eq!(counts.bytes, 4 * chunk(true, 4).len() as u64);
    }
}
