//! A file whose recorder was killed, made whole: indexes and footer for everything
//! that can be read.

use super::read::walk;
use super::writer::options;
use crate::files::{cannot_read, write_atomic};
use anyhow::{Context, Result};
use mcap::records::{MessageHeader, Record};
use mcap::{Attachment, Summary, Writer};
use serde::Serialize;
use std::borrow::Cow;
use std::io::Cursor;
use std::path::Path;

/// What came of it.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct Recovered {
    /// The file was whole already and is as it was.
    pub was_whole: bool,
    /// Messages in it.
    pub messages: u64,
    /// From the first to the last message (s), rounded down.
    pub span_s: u64,
    /// Chunks and attachments left out because they are damaged.
    pub damaged: u32,
    /// Bytes at the end left out because they are the begin of something.
    pub cut_bytes: usize,
}

/// Makes `path` whole; a file that is whole stays as it is.
///
/// # Errors
/// It cannot be read or written, or is no MCAP file.
pub fn recover(path: &Path) -> Result<Recovered> {
    let fail = || format!("`{}`", path.display());
    let bytes = std::fs::read(path).map_err(cannot_read(path))?;
    let mut writer = options().create(Cursor::new(Vec::new()))?;
    let mut found = Recovered::default();
    let mut span_ns: Option<(u64, u64)> = None;
    let walked = walk(&bytes, |record| {
        if let Record::Message { header, .. } = record {
            found.messages += 1;
            let (first, last) = span_ns.unwrap_or((header.log_time, header.log_time));
            span_ns = Some((first.min(header.log_time), last.max(header.log_time)));
        }
        copy(&mut writer, record)
    })
    .with_context(fail)?;
    found.span_s = span_ns.map_or(0, |(first, last)| (last - first) / 1_000_000_000);
    (found.damaged, found.cut_bytes) = (walked.damaged_chunks, walked.cut_bytes);
    found.was_whole =
        walked.whole && found.damaged == 0 && matches!(Summary::read(&bytes), Ok(Some(_)));
    if !found.was_whole {
        writer.finish().with_context(fail)?;
        write_atomic(path, writer.into_inner().get_ref())?;
    }
    Ok(found)
}

fn copy(writer: &mut Writer<Cursor<Vec<u8>>>, record: &Record<'_>) -> Result<()> {
    match record {
        Record::Schema { header, data } => {
            writer.add_schema_with_id(header.id, &header.name, &header.encoding, data)?;
        }
        Record::Channel(c) => {
            writer.add_channel_with_id(
                c.id,
                c.schema_id,
                &c.topic,
                &c.message_encoding,
                &c.metadata,
            )?;
        }
        Record::Message { header, data } => {
            let header = MessageHeader { ..*header };
            writer.write_to_known_channel(&header, data)?;
        }
        Record::Attachment { header, data, .. } => writer.attach(&Attachment {
            log_time: header.log_time,
            create_time: header.create_time,
            name: header.name.clone(),
            media_type: header.media_type.clone(),
            data: Cow::Borrowed(data),
        })?,
        Record::Metadata(metadata) => writer.write_metadata(metadata)?,
        _ => {}
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::channel::Channel;
    use super::super::messages::{Level, log};
    use super::super::writer::McapFile;
    use super::*;
    use std::time::Duration;

    /// Three chunks, an attachment and a table; returns the bytes of the whole file.
    fn write(path: &Path) -> Vec<u8> {
        let mut file = McapFile::create(path).unwrap();
        file.attach(1, "a.txt", "text/plain", b"attached").unwrap();
        file.metadata("m", &[("key", "value".to_owned())]).unwrap();
        for second in 0..3u64 {
            for n in 0..10u64 {
                let at_ns = second * 1_000_000_000 + n;
                file.json(Channel::Log, at_ns, &log(at_ns, Level::Info, "x"))
                    .unwrap();
            }
            std::thread::sleep(Duration::from_millis(410));
            file.turn().unwrap();
        }
        file.finish().unwrap();
        std::fs::read(path).unwrap()
    }

    #[test]
    fn cut_anywhere_a_file_is_recovered_up_to_its_last_whole_chunk() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("run.mcap");
        let whole = write(&path);
        let untouched = recover(&path).unwrap();
        assert_eq!((untouched.was_whole, untouched.messages), (true, 30));
        assert_eq!(std::fs::read(&path).unwrap(), whole);
        let mut seen = std::collections::BTreeSet::new();
        let index = Summary::read(&whole).unwrap().unwrap();
        // Around the end of every chunk, and here and there.
        let ends = index.chunk_indexes.iter().flat_map(|chunk| {
            let end = usize::try_from(chunk.chunk_start_offset + chunk.chunk_length).unwrap();
            [end - 1, end, end + 1]
        });
        for len in ends.chain((8..whole.len()).step_by(whole.len() / 20)) {
            std::fs::write(&path, &whole[..len]).unwrap();
            let found = recover(&path).unwrap();
            assert!(
                !found.was_whole && found.messages.is_multiple_of(10),
                "{len}: {found:?}"
            );
            seen.insert(found.messages);
            let bytes = std::fs::read(&path).unwrap();
            let summary = Summary::read(&bytes).unwrap().unwrap();
            assert_eq!(summary.stats.unwrap().message_count, found.messages);
            assert!(recover(&path).unwrap().was_whole);
        }
        assert_eq!(seen.into_iter().collect::<Vec<_>>(), [0, 10, 20, 30]);
    }

    #[test]
    fn a_damaged_chunk_is_left_out_and_said() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("run.mcap");
        let mut bytes = write(&path);
        let index = Summary::read(&bytes).unwrap().unwrap();
        let middle = &index.chunk_indexes[2];
        let at = usize::try_from(middle.chunk_start_offset + middle.chunk_length / 2).unwrap();
        bytes[at] ^= 0x55;
        std::fs::write(&path, &bytes).unwrap();
        let found = recover(&path).unwrap();
        assert_eq!((found.damaged, found.messages), (1, 20), "{found:?}");
        std::fs::write(&path, b"no such file").unwrap();
        let said = format!("{:#}", recover(&path).unwrap_err());
        assert!(
            said.contains("not an MCAP file") && said.contains("run.mcap"),
            "{said}"
        );
    }
}
