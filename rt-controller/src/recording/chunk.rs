//! Chunks: some items behind a header with a checksum.
//!
//! | bytes | what |
//! |---|---|
//! | 0..4 | `WAGR` |
//! | 4..6 | layout: [`FORMAT`], or [`FORMAT_1`] of older recordings |
//! | 6..8 | 1 when the first item is a keyframe |
//! | 8..12 | number of the chunk since the controller began; a gap is a loss |
//! | 12..16 | number of items |
//! | 16..20 | bytes of the items |
//! | 20..24 | CRC-32 of bytes 0..20 and of the items |
//!
//! All numbers are little-endian; the items follow, in postcard.

/// Version of the layout of chunks and items that is written.
pub const FORMAT: u16 = 2;
/// The layout before, which is still read: the states in its keyframes differ.
pub const FORMAT_1: u16 = 1;
/// Bytes of a header.
pub const HEADER_LEN: usize = 24;
/// Largest chunk, header included: a keyframe, two long motions and some cycles.
pub const CHUNK_MAX: usize = 64 * 1024;

const MAGIC: [u8; 4] = *b"WAGR";
const KEYFRAME: u16 = 1;
const CHECKED: usize = 20;

/// What a chunk's header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Header {
    /// Layout of the items: [`FORMAT`] or [`FORMAT_1`].
    pub format: u16,
    /// Whether the first item is a keyframe.
    pub keyframe: bool,
    /// Number of the chunk.
    pub sequence: u32,
    /// Number of items.
    pub items: u32,
}

/// What is found at the front of some bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Front<'a> {
    /// A whole chunk with a right checksum.
    Chunk {
        /// Its header.
        header: Header,
        /// Its items.
        payload: &'a [u8],
    },
    /// The beginning of a chunk, or nothing.
    Cut,
    /// A chunk of another layout.
    OtherFormat(u16),
    /// No chunk, or one with a wrong checksum.
    Damaged,
}

/// Writes header and items of a chunk behind each other into `out`, which is
/// emptied first. A payload too long for its field could not have been collected.
pub fn write(out: &mut Vec<u8>, keyframe: bool, sequence: u32, items: u32, payload: &[u8]) {
    out.clear();
    out.extend_from_slice(&MAGIC);
    out.extend_from_slice(&FORMAT.to_le_bytes());
    out.extend_from_slice(&if keyframe { KEYFRAME } else { 0 }.to_le_bytes());
    out.extend_from_slice(&sequence.to_le_bytes());
    out.extend_from_slice(&items.to_le_bytes());
    let len = u32::try_from(payload.len()).unwrap_or(u32::MAX);
    out.extend_from_slice(&len.to_le_bytes());
    let crc = checksum(out, payload);
    out.extend_from_slice(&crc.to_le_bytes());
    out.extend_from_slice(payload);
}

/// Reads the chunk at the front of `bytes`.
#[must_use]
pub fn read(bytes: &[u8]) -> Front<'_> {
    let Some((head, rest)) = bytes.split_at_checked(HEADER_LEN) else {
        let begun = bytes.len().min(MAGIC.len());
        return if bytes.get(..begun) == MAGIC.get(..begun) {
            Front::Cut
        } else {
            Front::Damaged
        };
    };
    if !head.starts_with(&MAGIC) {
        return Front::Damaged;
    }
    let format = u16_at(head, 4);
    if !matches!(format, FORMAT | FORMAT_1) {
        return Front::OtherFormat(format);
    }
    let payload_len = usize::try_from(u32_at(head, 16)).unwrap_or(usize::MAX);
    if payload_len > CHUNK_MAX {
        return Front::Damaged;
    }
    let Some(payload) = rest.get(..payload_len) else {
        return Front::Cut;
    };
    let checked = head.get(..CHECKED).unwrap_or_default();
    if checksum(checked, payload) != u32_at(head, CHECKED) {
        return Front::Damaged;
    }
    Front::Chunk {
        header: Header {
            format,
            keyframe: u16_at(head, 6) & KEYFRAME != 0,
            sequence: u32_at(head, 8),
            items: u32_at(head, 12),
        },
        payload,
    }
}

/// Bytes from the front of `bytes` to what looks like the next chunk, or to the
/// end.
#[must_use]
pub fn distance_to_next(bytes: &[u8]) -> usize {
    bytes
        .windows(MAGIC.len())
        .skip(1)
        .position(|w| w == MAGIC)
        .map_or(bytes.len(), |at| at + 1)
}

fn checksum(head: &[u8], payload: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head);
    hasher.update(payload);
    hasher.finalize()
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(array_at(bytes, at))
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(array_at(bytes, at))
}

fn array_at<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
    let rest = bytes.get(at..).unwrap_or_default();
    rest.first_chunk().copied().unwrap_or([0; N])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk() -> Vec<u8> {
        let mut out = Vec::new();
        write(&mut out, true, 7, 2, b"two items");
        out
    }

    #[test]
    fn a_chunk_comes_back() {
        let bytes = chunk();
        let Front::Chunk { header, payload } = read(&bytes) else {
            panic!("{:?}", read(&bytes));
        };
        assert_eq!(
            (header.keyframe, header.sequence, header.items),
            (true, 7, 2)
        );
        assert_eq!(payload, b"two items");
        assert_eq!(bytes.len(), HEADER_LEN + payload.len());
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_noticed() {
        let bytes = chunk();
        for cut in 0..bytes.len() {
            assert_eq!(read(&bytes[..cut]), Front::Cut, "{cut}");
        }
        for bit in 0..8 * bytes.len() {
            let mut bad = bytes.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(!matches!(read(&bad), Front::Chunk { .. }), "bit {bit}");
        }
    }

    #[test]
    fn the_next_chunk_is_found_behind_damage() {
        let mut bytes = b"WAGRxx some noise".to_vec();
        let noise = bytes.len();
        bytes.extend(chunk());
        assert_eq!(distance_to_next(&bytes), noise);
        assert_eq!(distance_to_next(b"none"), 4);
    }
}
