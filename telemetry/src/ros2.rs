//! A publisher on DDS for whatever speaks ROS 2: the topics, types and values of a run's bag
//! ([`run_export::ros2`]).
//!
//! It has writers only: nothing can be sent to it but what DDS needs to find and to acknowledge.
//! Nobody is waited for: what a reader does not take in is dropped.

use crate::domain::Domain;
use anyhow::{Context, Result, bail};
use cli_output::{OrInput, Outcome};
use run_export::ros2::{ALL, Messages, PICTURES, Promise, Topic, Translation};
use run_log::{Channel, Sink};
use rustdds::bytes::Bytes;
use rustdds::dds::WriteError;
use rustdds::dds::statusevents::{DataWriterStatus, StatusEvented};
use rustdds::no_key::{DataWriter, SerializerAdapter};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, DomainParticipantBuilder, Duration, QosPolicies, QosPolicyBuilder,
    RepresentationIdentifier, TopicKind,
};
use serde_json::Value;
use std::cell::Cell;
use std::convert::Infallible;
use std::fmt;
use std::net::Ipv4Addr;

/// A reader that stays and acknowledges nothing would stop its topic for all: after so many
/// messages that the library did not take, a second of the fastest, the writer is another.
const REFUSED_MAX: u32 = 250;
/// The library notes for each reader that comes every message that there ever was: after a
/// quarter of an hour of the fastest the writer is another.
const GIVEN_MAX: u32 = 225_000;
/// Length of the encapsulation header of a message, which DDS puts there itself.
const ENCAPSULATION: usize = 4;
/// Messages kept for a reader that lost one.
const DEPTH: u32 = 10;

/// A message in CDR, passed on as it is.
struct Encoded;

impl SerializerAdapter<Bytes> for Encoded {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(message: &Bytes) -> Result<Bytes, Infallible> {
        Ok(message.clone())
    }
}

/// A writer for each topic of a run.
#[derive(Debug)]
pub struct Publisher {
    translation: Translation,
    writers: Writers,
}

/// Fields are dropped in order.
struct Writers {
    of_topics: Vec<TopicWriter>,
    /// Writers end with it, and do not keep it.
    _participant: DomainParticipant,
}

/// The writer of one topic.
struct TopicWriter {
    topic: &'static Topic,
    quality: QosPolicies,
    in_dds: rustdds::Topic,
    publisher: rustdds::Publisher,
    writer: DataWriter<Bytes, Encoded>,
    /// Messages that this writer has been given, and those in a row that it did not take.
    given: u32,
    refused: u32,
    /// As the library told last.
    readers: Cell<i32>,
}

impl Publisher {
    /// Joins a DDS domain and offers every topic there, in the whole network or, where ROS's own
    /// programs are told so, on this machine alone.
    ///
    /// # Errors
    /// The network lets no one in.
    pub fn start(domain: Domain) -> Outcome<Self> {
        Self::join(domain).or_failed()
    }

    fn join(domain: Domain) -> Result<Self> {
        let Domain { id, is_local } = domain;
        let fail = || format!("cannot join DDS domain {id}");
        let mut builder = DomainParticipantBuilder::new(id);
        if is_local {
            builder = builder.with_only_networks([Ipv4Addr::LOCALHOST]);
        }
        let participant = builder.build().with_context(fail)?;
        let of_topics = ALL.into_iter().map(|topic| {
            let writer = TopicWriter::new(&participant, topic);
            writer.with_context(fail)
        });
        Ok(Self {
            writers: Writers {
                of_topics: of_topics.collect::<Result<_>>()?,
                _participant: participant,
            },
            translation: Translation::default(),
        })
    }
}

impl Sink for Publisher {
    fn wants(&self, channel: Channel) -> bool {
        // Pictures alone cost something.
        match channel {
            Channel::Image => self.writers.has_reader(&PICTURES),
            channel => Translation::knows(channel),
        }
    }

    fn message(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()> {
        let Self {
            translation,
            writers,
        } = self;
        translation.message(channel, at_ns, message, writers)
    }

    /// Nothing of the run before is offered to those who come late.
    fn begin_anew(&mut self) -> Result<()> {
        self.translation = Translation::default();
        let mut writers = self.writers.of_topics.iter_mut();
        writers.try_for_each(TopicWriter::begin_anew)
    }
}

impl Writers {
    fn has_reader(&self, topic: &Topic) -> bool {
        let mut writers = self.of_topics.iter();
        let writer = writers.find(|writer| writer.topic.name == topic.name);
        writer.is_some_and(TopicWriter::has_reader)
    }
}

impl Messages for Writers {
    fn add(&mut self, topic: &'static Topic, _at_ns: u64, message: Vec<u8>) -> Result<()> {
        let mut writers = self.of_topics.iter_mut();
        let writer = writers.find(|writer| writer.topic.name == topic.name);
        let writer = writer.context("a topic without a writer")?;
        writer.write(Bytes::from(message).slice(ENCAPSULATION..))
    }
}

impl TopicWriter {
    /// For a topic, under the names that ROS gives topic and type in DDS.
    fn new(participant: &DomainParticipant, topic: &'static Topic) -> Result<Self> {
        let quality = quality_of_service(topic.promise);
        let full_name = topic.definition.full_name();
        let kind = full_name.replace("/msg/", "::msg::dds_::") + "_";
        let name = format!("rt{}", topic.name);
        let in_dds = participant.create_topic(name, kind, &quality, TopicKind::NoKey)?;
        let publisher = participant.create_publisher(&quality)?;
        let writer = publisher.create_datawriter_no_key(&in_dds, Some(quality.clone()))?;
        Ok(Self {
            topic,
            quality,
            in_dds,
            publisher,
            writer,
            given: 0,
            refused: 0,
            readers: Cell::new(0),
        })
    }

    fn has_reader(&self) -> bool {
        while let Some(status) = self.writer.try_recv_status() {
            if let DataWriterStatus::PublicationMatched { current, .. } = status {
                self.readers.set(current.count());
            }
        }
        self.readers.get() > 0
    }

    fn write(&mut self, message: Bytes) -> Result<()> {
        // Kept for those who come late: the same pose again would only be kept beside it.
        if self.topic.promise == (Promise::Latched { depth: 1 }) && self.given > 0 {
            return Ok(());
        }
        if self.given >= GIVEN_MAX || self.refused >= REFUSED_MAX {
            self.begin_anew()?;
        }
        match self.writer.write(message, None) {
            Ok(()) => (self.given, self.refused) = (self.given + 1, 0),
            // Too much is on its way to a reader that takes nothing in.
            Err(WriteError::WouldBlock { .. }) => self.refused += 1,
            Err(error) => bail!("cannot publish `{}`: {error}", self.topic.name),
        }
        Ok(())
    }

    /// A writer that has kept nothing takes the place of this one; readers find it by themselves.
    fn begin_anew(&mut self) -> Result<()> {
        let quality = Some(self.quality.clone());
        let topic = &self.in_dds;
        self.writer = self.publisher.create_datawriter_no_key(topic, quality)?;
        (self.given, self.refused) = (0, 0);
        self.readers.set(0);
        Ok(())
    }
}

impl fmt::Debug for Writers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.of_topics.iter().map(|writer| writer.topic.name);
        f.debug_set().entries(names).finish()
    }
}

fn quality_of_service(promise: Promise) -> QosPolicies {
    let reliable = Reliability::Reliable {
        max_blocking_time: Duration::ZERO,
    };
    let (reliability, durability, depth) = match promise {
        Promise::Reliable => (reliable, Durability::Volatile, DEPTH),
        Promise::Latched { depth } => (reliable, Durability::TransientLocal, depth),
        Promise::BestEffort => (Reliability::BestEffort, Durability::Volatile, DEPTH),
    };
    QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast {
            depth: i32::try_from(depth).unwrap_or(i32::MAX),
        })
        .build()
}
