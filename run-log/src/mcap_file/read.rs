//! Reading a file, whole or not.

use super::channel::Channel;
use anyhow::{Context, Result, ensure};
use mcap::MAGIC;
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use rt_controller::recording::chunk::{self, Front};
use std::collections::BTreeMap;

/// Opcode and length.
const FRONT_LEN: usize = 9;
/// Longest chunk, uncompressed (bytes); a longer one is damaged. The library believes
/// what a length says, and a wrong one would take all memory.
const LONGEST: usize = 1 << 28;

/// What was met on the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Walked {
    /// Chunks whose checksum or inside is wrong; nothing of them is told.
    pub damaged_chunks: u32,
    /// The data ended where they should.
    pub whole: bool,
    /// Bytes behind the last record that could be read, when they did not.
    pub cut_bytes: usize,
}

/// Whether bytes begin like an MCAP file.
pub(crate) fn is_mcap(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// The record at the front of `rest` as opcode, body and length; `None` when it is cut
/// off.
fn front(rest: &[u8]) -> Option<(u8, &[u8], usize)> {
    let (opcode, after) = rest.split_first()?;
    let len = usize::try_from(u64::from_le_bytes(*after.first_chunk()?)).ok()?;
    let end = FRONT_LEN.checked_add(len)?;
    Some((*opcode, rest.get(FRONT_LEN..end)?, end))
}

/// Whether the lengths within an attachment fit into it; the library takes that for
/// granted.
fn is_attachment(body: &[u8]) -> bool {
    let u32_at = |at: usize| {
        let bytes = body.get(at..)?.first_chunk()?;
        usize::try_from(u32::from_le_bytes(*bytes)).ok()
    };
    let end = || {
        let media = 20usize.checked_add(u32_at(16)?)?;
        let data = media.checked_add(4)?.checked_add(u32_at(media)?)?;
        let len = u64::from_le_bytes(*body.get(data..)?.first_chunk()?);
        data.checked_add(8 + 4)?
            .checked_add(usize::try_from(len).ok()?)
    };
    end().is_some_and(|end| end == body.len())
}

/// Hands schemas, channels, messages, attachments and metadata to `each` in the order
/// of the file.
///
/// # Errors
/// The bytes are no MCAP file, or `each` fails.
pub(crate) fn walk(
    bytes: &[u8],
    mut each: impl FnMut(&Record<'_>) -> Result<()>,
) -> Result<Walked> {
    ensure!(
        is_mcap(bytes),
        "this is not an MCAP file: it does not begin like one"
    );
    let mut rest = &bytes[MAGIC.len()..];
    let mut walked = Walked::default();
    while let Some((opcode, body, len)) = front(rest) {
        let record = &rest[..len];
        rest = &rest[len..];
        match opcode {
            op::DATA_END => {
                walked.whole = true;
                return Ok(walked);
            }
            op::CHUNK => match inside(record) {
                Some(records) => records.iter().try_for_each(&mut each)?,
                None => walked.damaged_chunks += 1,
            },
            op::ATTACHMENT if !is_attachment(body) => walked.damaged_chunks += 1,
            op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA => {
                match mcap::parse_record(opcode, body) {
                    Ok(record) => each(&record)?,
                    Err(_wrong) => walked.damaged_chunks += 1,
                }
            }
            _ => {}
        }
    }
    walked.cut_bytes = rest.len();
    Ok(walked)
}

/// Hands every message of the channels of this program to `each` in the order of the file,
/// with its time (wall clock, ns).
///
/// # Errors
/// The bytes are no MCAP file, or `each` fails.
pub(crate) fn messages(
    bytes: &[u8],
    mut each: impl FnMut(Channel, u64, &[u8]) -> Result<()>,
) -> Result<Walked> {
    let mut channels = BTreeMap::new();
    walk(bytes, |record| {
        match record {
            Record::Channel(found) => {
                let known = Channel::of_topic(&found.topic);
                channels.extend(known.map(|channel| (found.id, channel)));
            }
            Record::Message { header, data } => {
                if let Some(channel) = channels.get(&header.channel_id) {
                    let at_ns = header.log_time;
                    each(*channel, at_ns, data).with_context(|| {
                        format!("channel `{}`, time {at_ns} ns", channel.topic())
                    })?;
                }
            }
            _ => {}
        }
        Ok(())
    })
}

/// Bytes in which a chunk tells how long its records are together.
const UNCOMPRESSED_LEN: std::ops::Range<usize> = FRONT_LEN + 16..FRONT_LEN + 24;

/// All records of a chunk record; `None` unless all of them are there and right.
fn inside(chunk: &[u8]) -> Option<Vec<Record<'static>>> {
    let reported = u64::from_le_bytes(*chunk.get(UNCOMPRESSED_LEN)?.first_chunk()?);
    let reported = usize::try_from(reported).ok()?;
    // Nobody writes an empty one.
    if reported == 0 || reported > LONGEST {
        return None;
    }
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(LONGEST);
    let mut reader = LinearReader::new_with_options(options);
    let (mut rest, mut records, mut len) = (chunk, Vec::new(), 0);
    while let Some(event) = reader.next_event() {
        match event.ok()? {
            LinearReadEvent::ReadRequest(_) if rest.is_empty() => break,
            LinearReadEvent::ReadRequest(most) => {
                let (now, later) = rest.split_at(most.min(rest.len()));
                reader.insert(now.len()).copy_from_slice(now);
                reader.notify_read(now.len());
                rest = later;
            }
            LinearReadEvent::Record { data, opcode } => {
                // A chunk without a checksum may hold more than it tells.
                len += FRONT_LEN + data.len();
                if len > reported {
                    return None;
                }
                records.push(mcap::parse_record(opcode, data).ok()?.into_owned());
            }
        }
    }
    let allowed = |r: &Record<'_>| {
        matches!(
            r,
            Record::Schema { .. } | Record::Channel(_) | Record::Message { .. }
        )
    };
    (len == reported && records.iter().all(allowed)).then_some(records)
}

/// The exact recording of the control cycles in a file, from the first keyframe on; empty when
/// the file was cut or damaged before it began.
///
/// # Errors
/// The bytes are no MCAP file, or one of another program.
pub(crate) fn replay_bytes(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut id = None;
    let mut out = Vec::new();
    let walked = walk(bytes, |record| {
        match record {
            Record::Channel(channel) if channel.topic == Channel::Replay.topic() => {
                id = Some(channel.id);
            }
            Record::Message { header, data } if Some(header.channel_id) == id => {
                let begins =
                    matches!(chunk::read(data), Front::Chunk { header, .. } if header.keyframe);
                if begins || !out.is_empty() {
                    out.extend_from_slice(data);
                }
            }
            _ => {}
        }
        Ok(())
    })?;
    ensure!(
        id.is_some() || !walked.whole || walked.damaged_chunks > 0,
        "the MCAP file holds no channel `{}`: it was not recorded by this program",
        Channel::Replay.topic()
    );
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mcap_file::writer::options;
    use mcap::records::MessageHeader;
    use std::io::Cursor;

    #[test]
    fn a_file_cut_before_its_channels_holds_no_cycles() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(crate::files::RUN);
        let mut file = crate::McapFile::create(&path).unwrap();
        let message = serde_json::json!({});
        file.json(Channel::Log, 1, &message).unwrap();
        file.finish().unwrap();
        let whole = std::fs::read(&path).unwrap();
        let run = crate::Run::open(folder.path()).unwrap();
        for len in [whole.len(), MAGIC.len() + 40, MAGIC.len(), 0] {
            std::fs::write(&path, &whole[..len]).unwrap();
            let error = run.recording().unwrap_err();
            assert!(error.is::<crate::NoRecording>(), "{len}: {error}");
        }
        let mut foreign = options().create(Cursor::new(Vec::new())).unwrap();
        foreign.finish().unwrap();
        let foreign = foreign.into_inner().into_inner();
        let error = replay_bytes(&foreign).unwrap_err().to_string();
        assert!(error.contains("no channel `/wag/replay`"), "{error}");
    }

    #[test]
    fn a_chunk_without_a_checksum_holds_no_more_than_it_tells() {
        let file = Cursor::new(Vec::new());
        let options = options().calculate_chunk_crcs(false).disable_seeking(false);
        let mut writer = options.create(file).unwrap();
        let channel_id = writer
            .add_channel(0, "/zeros", "", &BTreeMap::new())
            .unwrap();
        let header = MessageHeader {
            channel_id,
            sequence: 0,
            log_time: 1,
            publish_time: 1,
        };
        for _ in 0..50 {
            writer.write_to_known_channel(&header, &[0; 4000]).unwrap();
        }
        writer.finish().unwrap();
        let mut bytes = writer.into_inner().into_inner();
        let read = |bytes: &[u8]| {
            let mut messages = 0;
            let walked = walk(bytes, |record| {
                messages += usize::from(matches!(record, Record::Message { .. }));
                Ok(())
            });
            (messages, walked.unwrap().damaged_chunks)
        };
        assert_eq!(read(&bytes), (50, 0));
        // The chunk comes right after the header record.
        let mut at = MAGIC.len();
        while bytes[at] != op::CHUNK {
            at += front(&bytes[at..]).unwrap().2;
        }
        let reported = at + UNCOMPRESSED_LEN.start..at + UNCOMPRESSED_LEN.end;
        for wrong in [1_u64 << 40, 100_000, 0] {
            bytes[reported.clone()].copy_from_slice(&wrong.to_le_bytes());
            assert_eq!(read(&bytes), (0, 1), "{wrong}");
        }
    }
}
