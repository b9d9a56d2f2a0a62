//! Recorded control cycles: chunks, items, and the core stepped over them.

use arm_model::Limits;
use rt_controller::control::record::record_input;
use rt_controller::control::{ControlState, CycleInput, Thresholds};
use rt_controller::recording::{ChunkWriter, LogReader, Read, RecordedCycle, Snapshot, replay};

/// Bytes of a chunk's header; its checksum is over the first of them and the items.
const HEADER_LEN: usize = 24;
const CHECKED: usize = 20;

/// Reads and replays `data`; when its checksums are wrong they are set right, so
/// that what lies behind them is met, too.
pub fn run(data: &[u8]) {
    read(data);
    read(&with_right_sums(data));
}

fn read(bytes: &[u8]) {
    if let Ok(reader) = LogReader::open(bytes) {
        let items = reader
            .take(10_000)
            .filter(|read| matches!(read, Read::Item(_)))
            .count();
        if items > 0 {
            let _ = replay(bytes, 0);
        }
    }
}

/// Chunks of `data` with the checksum that belongs to what is in them.
fn with_right_sums(data: &[u8]) -> Vec<u8> {
    let mut bytes = data.to_vec();
    let mut at = 0;
    while let Some(head) = bytes.get(at..at + HEADER_LEN) {
        let len = u32::from_le_bytes([head[16], head[17], head[18], head[19]]);
        let begin = at + HEADER_LEN;
        let end = begin.saturating_add(usize::try_from(len).unwrap_or(usize::MAX));
        let Some(payload) = bytes.get(begin..end) else {
            break;
        };
        let mut sum = crc32fast::Hasher::new();
        sum.update(&head[..CHECKED]);
        sum.update(payload);
        let sum = sum.finalize().to_le_bytes();
        bytes[at + CHECKED..begin].copy_from_slice(&sum);
        at = end;
    }
    bytes
}

/// A short recording.
pub fn seeds() -> Vec<Vec<u8>> {
    let mut control = ControlState::new(Limits::default(), Thresholds::strict());
    let mut writer = ChunkWriter::default();
    let mut bytes = Vec::new();
    let keyframe = Snapshot::of(&control).unwrap();
    bytes.extend(writer.keyframe(&keyframe).unwrap_or_default());
    for cycle in 1..=20 {
        let input = CycleInput {
            deadline_ns: 1_000_000_000 + 4_000_000 * cycle,
            ..CycleInput::default()
        };
        let reported = record_input(&input, cycle);
        let record = control.step(input).record;
        let cycle = RecordedCycle {
            input: reported,
            record,
        };
        bytes.extend(writer.cycle(&cycle).unwrap_or_default());
    }
    bytes.extend(writer.flush().unwrap_or_default());
    vec![bytes]
}
