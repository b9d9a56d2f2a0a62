//! A bag of rosbag2: a folder with one MCAP file and what is in it.

use super::topics::{Promise, Topic};
use super::translation::Messages;
use crate::destination_file::go_on;
use anyhow::{Context, Result};
use mcap::records::{MessageHeader, Statistics};
use mcap::{Compression, WriteOptions, Writer};
use run_log::files;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// What is in the bag.
pub(super) const METADATA: &str = "metadata.yaml";
/// The messages.
pub(super) const MESSAGES: &str = "run_0.mcap";
/// First line of [`METADATA`], by which an export knows an earlier one.
pub(super) const MARK: &str = "# Written by `wag export ros2`.\n";
/// The version of the metadata that ROS 2 Humble writes; every later one reads it.
const VERSION: u32 = 5;

/// What whoever plays the bag promises: nothing is the default, which is reliable. Otherwise
/// reliable, to whoever comes late too (`TRANSIENT_LOCAL`); numbers as Humble writes them.
fn quality_of_service(topic: &Topic) -> String {
    let Promise::Latched { depth } = topic.promise else {
        return String::new();
    };
    format!(
        "- history: 1
  depth: {depth}
  reliability: 1
  durability: 1
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
"
    )
}

/// What a topic has been given in the file.
struct Channel {
    topic: &'static Topic,
    id: u16,
    messages: u32,
}

/// A bag that is being written.
pub(super) struct Bag {
    writer: Writer<BufWriter<File>>,
    channels: BTreeMap<&'static str, Channel>,
    /// Whether something could not be written.
    is_failed: bool,
}

impl Bag {
    /// In a folder that is there and empty.
    pub(super) fn create(folder: &Path) -> Result<Self> {
        let file = BufWriter::new(File::create(folder.join(MESSAGES))?);
        let options = WriteOptions::new()
            .library(format!("wag {}", shared_types::VERSION))
            .profile("ros2")
            .compression(Some(Compression::Lz4));
        Ok(Self {
            writer: options.create(file)?,
            channels: BTreeMap::new(),
            is_failed: false,
        })
    }

    /// Whether adding a message has failed: not for what the run holds, but for where it goes.
    pub(super) fn is_failed(&self) -> bool {
        self.is_failed
    }

    fn write(&mut self, topic: &'static Topic, at_ns: u64, message: &[u8]) -> Result<()> {
        if !self.channels.contains_key(topic.name) {
            let channel = self.channel(topic)?;
            self.channels.insert(topic.name, channel);
        }
        let channel = self.channels.get_mut(topic.name);
        let channel = channel.context("a topic without a channel")?;
        let header = MessageHeader {
            channel_id: channel.id,
            sequence: channel.messages,
            log_time: at_ns,
            publish_time: at_ns,
        };
        channel.messages += 1;
        self.writer.write_to_known_channel(&header, message)?;
        Ok(())
    }

    fn channel(&mut self, topic: &'static Topic) -> Result<Channel> {
        let name = topic.definition.full_name();
        let text = topic.definition.text();
        let schema = self.writer.add_schema(&name, "ros2msg", text.as_bytes())?;
        let quality = quality_of_service(topic);
        let metadata = [("offered_qos_profiles".to_owned(), quality)].into();
        Ok(Channel {
            topic,
            id: self
                .writer
                .add_channel(schema, topic.name, "cdr", &metadata)?,
            messages: 0,
        })
    }

    /// Whether a message of the topic is there.
    pub(super) fn has(&self, topic: &Topic) -> bool {
        self.channels.contains_key(topic.name)
    }

    /// Writes the rest, and returns how many messages there are.
    pub(super) fn finish(mut self, folder: &Path) -> Result<u64> {
        let found = self.writer.finish()?.stats;
        let found = found.context("an MCAP file without statistics")?;
        let file = self.writer.into_inner().into_inner();
        file.map_err(std::io::IntoInnerError::into_error)?
            .sync_all()?;
        let metadata = metadata(&found, self.channels.values())?;
        files::write_atomic(&folder.join(METADATA), metadata.as_bytes())?;
        Ok(found.message_count)
    }
}

impl Messages for Bag {
    fn add(&mut self, topic: &'static Topic, at_ns: u64, message: Vec<u8>) -> Result<()> {
        let added = go_on().and_then(|()| self.write(topic, at_ns, &message));
        self.is_failed |= added.is_err();
        added
    }
}

/// The text of [`METADATA`].
fn metadata<'a>(found: &Statistics, channels: impl Iterator<Item = &'a Channel>) -> Result<String> {
    let (begin_ns, count) = (found.message_start_time, found.message_count);
    let duration_ns = found.message_end_time - begin_ns;
    let mut topics = String::new();
    for channel in channels {
        let topic = channel.topic;
        // A text of JSON is one of YAML.
        let quality = serde_json::to_string(&quality_of_service(topic))?;
        topics.push_str(&format!(
            "    - topic_metadata:
        name: {}
        type: {}
        serialization_format: cdr
        offered_qos_profiles: {quality}
      message_count: {}
",
            topic.name,
            topic.definition.full_name(),
            channel.messages
        ));
    }
    Ok(format!(
        "{MARK}rosbag2_bagfile_information:
  version: {VERSION}
  storage_identifier: mcap
  duration:
    nanoseconds: {duration_ns}
  starting_time:
    nanoseconds_since_epoch: {begin_ns}
  message_count: {count}
  topics_with_message_count:
{topics}  compression_format: \"\"
  compression_mode: \"\"
  relative_file_paths:
    - {MESSAGES}
  files:
    - path: {MESSAGES}
      starting_time:
        nanoseconds_since_epoch: {begin_ns}
      duration:
        nanoseconds: {duration_ns}
      message_count: {count}
"
    ))
}
