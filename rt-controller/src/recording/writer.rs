//! Items into chunks.

use super::chunk;
use super::item::{CORE_VERSION, Item, Keyframe, RecordedCycle, Snapshot};
use crate::control::Motion;
use shared_types::ipc::CauseRecord;

/// Cycles of a chunk: a tenth of a second at 250 Hz.
const CYCLES_PER_CHUNK: u32 = 25;
/// A chunk that has grown this long is closed (bytes).
const CLOSE_AT: usize = 16 * 1024;
/// Motions a keyframe carries: the running one and the next.
const MOTIONS: usize = 2;

/// Collects items and hands out whole chunks. Not RT-safe.
#[derive(Debug, Default)]
pub struct ChunkWriter {
    payload: Vec<u8>,
    chunk: Vec<u8>,
    keyframe: bool,
    items: u32,
    cycles: u32,
    sequence: u32,
    motions: Vec<(u64, Box<Motion>)>,
}

impl ChunkWriter {
    /// Begins a chunk with a keyframe; returns the chunk that ends before it.
    pub fn keyframe(&mut self, snapshot: &Snapshot) -> Option<&[u8]> {
        let ended = self.close();
        let keyframe = Keyframe {
            core: CORE_VERSION.to_owned(),
            next_cycle: snapshot.next_cycle,
            state: snapshot.as_bytes().to_vec(),
            motions: self.motions.clone(),
        };
        self.keyframe = true;
        self.add(&Item::Keyframe(Box::new(keyframe)));
        ended.then_some(&self.chunk)
    }

    /// Adds a motion that is about to be commanded.
    pub fn motion(&mut self, id: u64, motion: &Motion) {
        let motion = Box::new(motion.clone());
        if self.motions.len() == MOTIONS {
            self.motions.remove(0);
        }
        self.motions.push((id, motion.clone()));
        self.add(&Item::Motion { id, motion });
    }

    /// Adds a cause.
    pub fn cause(&mut self, cause: &CauseRecord) {
        self.add(&Item::Cause(Box::new(*cause)));
    }

    /// Adds a cycle; returns a chunk when one is full.
    pub fn cycle(&mut self, cycle: &RecordedCycle) -> Option<&[u8]> {
        self.add(&Item::Cycle(Box::new(*cycle)));
        self.cycles += 1;
        if self.cycles >= CYCLES_PER_CHUNK || self.payload.len() >= CLOSE_AT {
            self.flush()
        } else {
            None
        }
    }

    /// The items collected so far as a chunk, if there are any.
    pub fn flush(&mut self) -> Option<&[u8]> {
        self.close().then_some(&self.chunk)
    }

    fn close(&mut self) -> bool {
        if self.items == 0 {
            return false;
        }
        chunk::write(
            &mut self.chunk,
            self.keyframe,
            self.sequence,
            self.items,
            &self.payload,
        );
        self.sequence = self.sequence.wrapping_add(1);
        self.payload.clear();
        self.keyframe = false;
        (self.items, self.cycles) = (0, 0);
        true
    }

    fn add(&mut self, item: &Item) {
        match postcard::to_allocvec(item) {
            Ok(bytes) => {
                self.payload.extend_from_slice(&bytes);
                self.items += 1;
            }
            // No item holds what postcard cannot write.
            Err(reason) => tracing::error!(%reason, "an item could not be recorded"),
        }
    }
}
