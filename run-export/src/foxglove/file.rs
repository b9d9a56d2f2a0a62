//! The file that is written, record by record of the run's.

use super::encoding::{Encoding, of_schema};
use crate::destination_file::go_on;
use anyhow::{Context, Result};
use mcap::records::{self, MessageHeader, Record, SchemaHeader};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Cursor;

/// A channel of the run's file that is written.
struct Channel {
    topic: String,
    /// Its number in what is written.
    id: u16,
    /// How its messages are turned into Protobuf, if they are.
    encoding: Option<Encoding>,
    messages: u64,
}

/// A file that is being written, in memory.
pub(super) struct FoxgloveFile {
    writer: Writer<Cursor<Vec<u8>>>,
    /// Schemas and channels of the run's file by their numbers there.
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    channels: BTreeMap<u16, Channel>,
}

/// Whether a file begins as an export does: a header without a profile, written by this program.
pub(super) fn is_export(begin: &[u8]) -> bool {
    // Behind the magic the record's kind, its length, no profile, and the library's name.
    let rest = begin
        .strip_prefix(mcap::MAGIC)
        .and_then(|rest| rest.get(9..));
    let name = rest.and_then(|rest| rest.strip_prefix(&[0; 4])?.get(4..));
    name.is_some_and(|name| name.starts_with(b"wag "))
}

impl FoxgloveFile {
    /// A file without a record.
    pub(super) fn new() -> Result<Self> {
        let options = WriteOptions::new()
            .library(format!("wag {}", shared_types::VERSION))
            .profile("")
            .compression(Some(Compression::Lz4));
        Ok(Self {
            writer: options.create(Cursor::new(Vec::new()))?,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
        })
    }

    /// Adds what a record of the run's file is here.
    ///
    /// # Errors
    /// A message is not as its schema has it.
    pub(super) fn add(&mut self, record: &Record<'_>) -> Result<()> {
        go_on()?;
        match record {
            Record::Schema { header, data } => {
                let schema = (header.clone(), data.to_vec());
                self.schemas.insert(header.id, schema);
            }
            Record::Channel(channel) if channel.topic != run_log::Channel::Replay.topic() => {
                self.add_channel(channel)?;
            }
            Record::Message { header, data } => self.add_message(header, data)?,
            Record::Attachment { header, data, .. } => self.writer.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name.clone(),
                media_type: header.media_type.clone(),
                data: Cow::Borrowed(data),
            })?,
            Record::Metadata(metadata) => self.writer.write_metadata(metadata)?,
            _ => {}
        }
        Ok(())
    }

    fn add_channel(&mut self, found: &records::Channel) -> Result<()> {
        let (topic, metadata) = (&found.topic, &found.metadata);
        if self.channels.contains_key(&found.id) {
            return Ok(());
        }
        let schema = self.schemas.get(&found.schema_id);
        let encoding = schema.and_then(|(header, _)| of_schema(&header.name));
        let (schema_id, message_encoding) = match (&encoding, schema) {
            (Some(encoding), _) => {
                let (name, kind, data) = encoding.schema()?;
                (self.writer.add_schema(&name, &kind, &data)?, kind)
            }
            (None, Some((header, data))) => {
                let id = self
                    .writer
                    .add_schema(&header.name, &header.encoding, data)?;
                (id, found.message_encoding.clone())
            }
            (None, None) => (0, found.message_encoding.clone()),
        };
        let id = self
            .writer
            .add_channel(schema_id, topic, &message_encoding, metadata)?;
        let channel = Channel {
            topic: topic.clone(),
            id,
            encoding,
            messages: 0,
        };
        self.channels.insert(found.id, channel);
        Ok(())
    }

    fn add_message(&mut self, header: &MessageHeader, data: &[u8]) -> Result<()> {
        let Some(channel) = self.channels.get_mut(&header.channel_id) else {
            return Ok(());
        };
        let encoded = match &channel.encoding {
            Some(encoding) => {
                let place = || format!("channel `{}`, time {} ns", channel.topic, header.log_time);
                Cow::Owned(encoding.encode(data).with_context(place)?)
            }
            None => Cow::Borrowed(data),
        };
        let header = MessageHeader {
            channel_id: channel.id,
            ..*header
        };
        channel.messages += 1;
        Ok(self.writer.write_to_known_channel(&header, &encoded)?)
    }

    /// How many messages there are, and how many of them in Protobuf.
    pub(super) fn counts(&self) -> (u64, u64) {
        let sum = |wanted: fn(&&Channel) -> bool| {
            let channels = self.channels.values().filter(wanted);
            channels.map(|channel| channel.messages).sum()
        };
        (sum(|_| true), sum(|channel| channel.encoding.is_some()))
    }

    /// Topics without a message.
    pub(super) fn silent_topics(&self) -> impl Iterator<Item = String> {
        let silent = self.channels.values().filter(|c| c.messages == 0);
        silent.map(|channel| channel.topic.clone())
    }

    /// Its bytes.
    pub(super) fn finish(mut self) -> Result<Vec<u8>> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().into_inner())
    }
}
