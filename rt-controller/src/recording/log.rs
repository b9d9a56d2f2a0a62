//! Chunks back into items, past every kind of damage.

use super::chunk::{self, Front};
use super::item::Item;

/// Why bytes are no recording at all.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LogError {
    /// Nothing in it.
    #[error("the recording is empty: nothing was recorded, or the disk was full")]
    Empty,
    /// Something else.
    #[error("this is not a recording of control cycles: it does not begin with a chunk")]
    Foreign,
    /// Another layout.
    #[error(
        "the recording has layout {0}, this program reads layouts {known_1} and {known_2}; use the version of `wag` that made it",
        known_1 = chunk::FORMAT_1,
        known_2 = chunk::FORMAT
    )]
    Format(u16),
    /// The first chunk is not whole; so many bytes are there.
    #[error("the recording is cut off within its first chunk ({0} bytes): nothing can be read")]
    Cut(usize),
}

/// A place where a recording does not go on as it should.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Flaw {
    /// Chunks that never reached the file.
    #[error("{chunks} chunk(s) before chunk {before} never reached the file")]
    Lost {
        /// How many.
        chunks: u32,
        /// Number of the chunk after them.
        before: u32,
    },
    /// Bytes that are no chunk, or one with a wrong checksum.
    #[error("{bytes} bytes from byte {offset} on are damaged")]
    Damaged {
        /// Where they begin in the file.
        offset: usize,
        /// How many.
        bytes: usize,
    },
    /// The file ends within a chunk.
    #[error(
        "the file ends within a chunk: the last {bytes} bytes, from byte {offset} on, cannot be read"
    )]
    Cut {
        /// Where that chunk begins in the file.
        offset: usize,
        /// Bytes of it that are there.
        bytes: usize,
    },
}

/// What comes next in a recording.
#[derive(Debug, Clone, PartialEq)]
pub enum Read {
    /// An item.
    Item(Item),
    /// Something is missing here; items go on behind it, from a keyframe they
    /// make sense again.
    Flaw(Flaw),
}

/// Reads a recording item by item.
#[derive(Debug, Clone)]
pub struct LogReader<'a> {
    bytes: &'a [u8],
    offset: usize,
    /// Items left of the present chunk, their layout, and where it began.
    items: &'a [u8],
    format: u16,
    chunk_at: usize,
    next_sequence: Option<u32>,
}

impl<'a> LogReader<'a> {
    /// Looks at the first chunk.
    pub fn open(bytes: &'a [u8]) -> Result<Self, LogError> {
        match chunk::read(bytes) {
            _ if bytes.is_empty() => Err(LogError::Empty),
            Front::OtherFormat(found) => Err(LogError::Format(found)),
            Front::Cut if chunk::distance_to_next(bytes) == bytes.len() => {
                Err(LogError::Cut(bytes.len()))
            }
            // A damaged first chunk does not matter if others follow.
            Front::Damaged if chunk::distance_to_next(bytes) == bytes.len() => {
                Err(LogError::Foreign)
            }
            Front::Chunk { .. } | Front::Cut | Front::Damaged => Ok(Self {
                bytes,
                offset: 0,
                items: &[],
                format: chunk::FORMAT,
                chunk_at: 0,
                next_sequence: None,
            }),
        }
    }

    /// Takes in the next chunk; `None` at the end.
    fn next_chunk(&mut self) -> Option<Option<Flaw>> {
        let rest = self.bytes.get(self.offset..).filter(|r| !r.is_empty())?;
        match chunk::read(rest) {
            Front::Chunk { header, payload } => {
                self.chunk_at = self.offset;
                self.items = payload;
                self.format = header.format;
                self.offset += chunk::HEADER_LEN + payload.len();
                let expected = self.next_sequence.unwrap_or(header.sequence);
                self.next_sequence = Some(header.sequence.wrapping_add(1));
                // A controller that starts anew counts from zero again.
                let missing = header.sequence.wrapping_sub(expected);
                let anew = header.sequence == 0;
                Some((missing != 0 && !anew).then_some(Flaw::Lost {
                    chunks: missing,
                    before: header.sequence,
                }))
            }
            Front::Cut if chunk::distance_to_next(rest) == rest.len() => {
                let flaw = Flaw::Cut {
                    offset: self.offset,
                    bytes: rest.len(),
                };
                self.offset = self.bytes.len();
                Some(Some(flaw))
            }
            Front::Cut | Front::OtherFormat(_) | Front::Damaged => {
                // The checksum says that a chunk is missing; the numbers need not.
                self.next_sequence = None;
                let (offset, bytes) = (self.offset, chunk::distance_to_next(rest));
                self.offset += bytes;
                Some(Some(Flaw::Damaged { offset, bytes }))
            }
        }
    }
}

impl Iterator for LogReader<'_> {
    type Item = Read;

    fn next(&mut self) -> Option<Read> {
        while self.items.is_empty() {
            if let Some(flaw) = self.next_chunk()? {
                return Some(Read::Flaw(flaw));
            }
        }
        match postcard::take_from_bytes::<Item>(self.items) {
            Ok((item, rest)) => {
                self.items = rest;
                Some(Read::Item(match self.format {
                    chunk::FORMAT_1 => item.into_layout_2(),
                    _ => item,
                }))
            }
            // The checksum is right, so it was written by another layout.
            Err(_) => {
                self.items = &[];
                Some(Read::Flaw(Flaw::Damaged {
                    offset: self.chunk_at,
                    bytes: self.offset - self.chunk_at,
                }))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ChunkWriter, Keyframe, RecordedCycle};
    use super::*;

    fn recording(cycles: u64) -> Vec<u8> {
        let mut writer = ChunkWriter::default();
        let mut bytes = Vec::new();
        for cycle in 1..=cycles {
            let mut one = RecordedCycle::default();
            one.input.cycle = cycle;
            bytes.extend(writer.cycle(&one).unwrap_or_default());
        }
        bytes.extend(writer.flush().unwrap_or_default());
        bytes
    }

    fn cycles(bytes: &[u8]) -> (Vec<u64>, Vec<Flaw>) {
        let (mut found, mut flaws) = (Vec::new(), Vec::new());
        for read in LogReader::open(bytes).unwrap() {
            match read {
                Read::Item(Item::Cycle(c)) => found.push(c.input.cycle),
                Read::Item(other) => panic!("{other:?}"),
                Read::Flaw(flaw) => flaws.push(flaw),
            }
        }
        (found, flaws)
    }

    #[test]
    fn a_file_cut_anywhere_reads_up_to_its_last_whole_chunk() {
        let bytes = recording(60);
        assert_eq!(cycles(&bytes), ((1..=60).collect(), vec![]));
        let first = chunk::distance_to_next(&bytes);
        for cut in (first..bytes.len()).step_by(97) {
            let (found, flaws) = cycles(&bytes[..cut]);
            assert!(matches!(found.len(), 25 | 50), "{} at {cut}", found.len());
            let whole = cut % first == 0;
            assert_eq!(flaws.is_empty(), whole, "{flaws:?}");
        }
        assert_eq!(
            LogReader::open(&bytes[..first - 1]).unwrap_err(),
            LogError::Cut(first - 1)
        );
    }

    #[test]
    fn damage_and_losses_are_told_apart_and_stepped_over() {
        let bytes = recording(75);
        let chunk = chunk::distance_to_next(&bytes);
        let mut damaged = bytes.clone();
        damaged[chunk + 100] ^= 1;
        let (found, flaws) = cycles(&damaged);
        assert_eq!(found, (1..=25).chain(51..=75).collect::<Vec<_>>());
        assert_eq!(
            flaws,
            [Flaw::Damaged {
                offset: chunk,
                bytes: chunk
            }]
        );
        let mut lost = bytes.clone();
        lost.drain(chunk..2 * chunk);
        assert_eq!(
            cycles(&lost).1,
            [Flaw::Lost {
                chunks: 1,
                before: 2
            }]
        );
    }

    /// Its cycles are read all the same; only a replay cannot begin there.
    #[test]
    fn a_keyframe_that_cannot_be_read_costs_nothing_else_of_its_chunk() {
        let keyframe = Keyframe {
            core: "of another time".to_owned(),
            next_cycle: 1,
            state: b"no state".to_vec(),
            motions: Vec::new(),
        };
        let mut items = postcard::to_allocvec(&Item::Keyframe(Box::new(keyframe))).unwrap();
        for cycle in 1..=3 {
            let mut one = RecordedCycle::default();
            one.input.cycle = cycle;
            items.extend(postcard::to_allocvec(&Item::Cycle(Box::new(one))).unwrap());
        }
        for format in [chunk::FORMAT_1, chunk::FORMAT] {
            let mut bytes = Vec::new();
            chunk::write(&mut bytes, true, 0, 4, &items);
            bytes[4..6].copy_from_slice(&format.to_le_bytes());
            let mut crc = crc32fast::Hasher::new();
            crc.update(&bytes[..20]);
            crc.update(&items);
            bytes[20..24].copy_from_slice(&crc.finalize().to_le_bytes());
            let mut found = Vec::new();
            for read in LogReader::open(&bytes).unwrap() {
                match read {
                    Read::Item(Item::Keyframe(keyframe)) => {
                        assert!(keyframe.state().is_none(), "layout {format}");
                    }
                    Read::Item(Item::Cycle(c)) => found.push(c.input.cycle),
                    other => panic!("layout {format}: {other:?}"),
                }
            }
            assert_eq!(found, [1, 2, 3], "layout {format}");
        }
    }

    #[test]
    fn what_is_no_recording_is_refused() {
        let open = |bytes: &[u8]| LogReader::open(bytes).unwrap_err();
        assert_eq!(open(b""), LogError::Empty);
        assert_eq!(open(b"t,q1,q2\n0,0,0\n and so on"), LogError::Foreign);
        let mut other = recording(1);
        other[4] = 9;
        assert_eq!(open(&other), LogError::Format(9));
    }
}
