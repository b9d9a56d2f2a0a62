//! An MCAP file that grows by whole chunks.

use super::channel::Channel;
use super::feed::Sink;
use crate::files::cannot_write;
use anyhow::{Context, Result};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use serde_json::Value;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

/// What is not in the file yet is lost when the recorder is killed; a chunk is
/// closed this often.
const FLUSH_EVERY: Duration = Duration::from_millis(400);
/// A chunk that has grown this long is closed at once (bytes).
const CHUNK_BYTES: u64 = 1 << 20;

/// A file under way.
#[allow(
    missing_debug_implementations,
    reason = "the library's writer has none"
)]
pub struct McapFile {
    writer: Writer<File>,
    ids: Vec<u16>,
    sequences: Vec<u32>,
    flushed: Instant,
}

/// Options of every file written here.
pub(super) fn options() -> WriteOptions {
    WriteOptions::new()
        .library(format!("wag {}", shared_types::VERSION))
        .profile("")
        .compression(Some(Compression::Lz4))
        .chunk_size(Some(CHUNK_BYTES))
        // A chunk goes into the file in one piece when it is closed, not bit by bit.
        .disable_seeking(true)
}

impl Sink for McapFile {
    fn message(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()> {
        self.json(channel, at_ns, message)
    }

    fn chunk(&mut self, at_ns: u64, bytes: &[u8]) -> Result<()> {
        self.bytes(Channel::Replay, at_ns, bytes)
    }
}

impl McapFile {
    /// Creates `path`, which must not exist, with every channel.
    pub fn create(path: &Path) -> Result<Self> {
        let file = File::options()
            .write(true)
            .create_new(true)
            .open(path)
            .map_err(cannot_write(path))?;
        let fail = || format!("cannot write `{}`", path.display());
        let mut writer = options().create(file).with_context(fail)?;
        let mut ids = Vec::new();
        for (channel, schema) in Channel::with_schemas()? {
            let (schema_id, encoding) = match schema {
                Some((name, text)) => {
                    let id = writer.add_schema(name, "jsonschema", text.as_bytes())?;
                    (id, "json")
                }
                None => (0, "wag-replay-chunk"),
            };
            ids.push(writer.add_channel(schema_id, channel.topic(), encoding, &BTreeMap::new())?);
        }
        Ok(Self {
            writer,
            ids,
            sequences: vec![0; Channel::ALL.len()],
            flushed: Instant::now(),
        })
    }

    /// Adds a JSON message of the instant `at_ns` (wall clock).
    pub fn json(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()> {
        self.bytes(channel, at_ns, message.to_string().as_bytes())
    }

    /// Adds a message of the instant `at_ns` (wall clock).
    pub fn bytes(&mut self, channel: Channel, at_ns: u64, data: &[u8]) -> Result<()> {
        let place = channel as usize;
        let header = MessageHeader {
            channel_id: self.ids[place],
            sequence: self.sequences[place],
            log_time: at_ns,
            publish_time: at_ns,
        };
        self.sequences[place] = self.sequences[place].wrapping_add(1);
        self.writer.write_to_known_channel(&header, data)?;
        Ok(())
    }

    /// Attaches a file.
    pub fn attach(&mut self, at_ns: u64, name: &str, media_type: &str, data: &[u8]) -> Result<()> {
        self.writer.attach(&Attachment {
            log_time: at_ns,
            create_time: at_ns,
            name: name.to_owned(),
            media_type: media_type.to_owned(),
            data: Cow::Borrowed(data),
        })?;
        Ok(())
    }

    /// Adds a table of texts.
    pub fn metadata(&mut self, name: &str, entries: &[(&str, String)]) -> Result<()> {
        let metadata = entries
            .iter()
            .map(|(key, value)| ((*key).to_owned(), value.clone()))
            .collect();
        self.writer.write_metadata(&Metadata {
            name: name.to_owned(),
            metadata,
        })?;
        Ok(())
    }

    /// Closes the chunk when it is time.
    pub fn turn(&mut self) -> Result<()> {
        if self.flushed.elapsed() >= FLUSH_EVERY {
            self.flush()?;
        }
        Ok(())
    }

    /// Closes the chunk, so that everything told so far can be read.
    pub(super) fn flush(&mut self) -> Result<()> {
        self.writer.flush()?;
        self.flushed = Instant::now();
        Ok(())
    }

    /// Writes indexes and footer.
    pub fn finish(mut self) -> Result<()> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().sync_all()?)
    }
}
