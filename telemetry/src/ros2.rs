//! A publisher on DDS for whatever speaks ROS 2: the topics, types and values of a run's bag
//! ([`run_export::ros2`]).
//!
//! It has writers only: nothing can be sent to it but what DDS needs to find and to acknowledge.
//! Nobody is waited for: what a reader does not take in is dropped.

#[cfg(feature = "ros2")]
mod publisher {
    use anyhow::{Context, Result, anyhow, ensure};
    use run_export::ros2::{ALL, Messages, Promise, Topic, Translation};
    use run_log::{Channel, Sink};
    use rustdds::bytes::Bytes;
    use rustdds::dds::WriteError;
    use rustdds::no_key::{DataWriter, SerializerAdapter};
    use rustdds::policy::{Durability, History, Reliability};
    use rustdds::{
        DomainParticipant, Duration, QosPolicies, QosPolicyBuilder, RepresentationIdentifier,
        TopicKind,
    };
    use serde_json::Value;
    use std::convert::Infallible;
    use std::fmt;

    /// The largest domain whose ports there are.
    const LAST_DOMAIN: u32 = 232;
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
        by_name: Vec<(&'static str, DataWriter<Bytes, Encoded>)>,
        /// Writers end with it, and do not keep it.
        _participant: DomainParticipant,
    }

    impl Publisher {
        /// Joins the DDS domain `domain_id` (`ROS_DOMAIN_ID`, 0 where that is not set) and offers
        /// every topic there.
        ///
        /// # Errors
        /// There is no such domain, or the network lets no one in.
        pub fn start(domain_id: u32) -> Result<Self> {
            let there = domain_id <= LAST_DOMAIN;
            ensure!(
                there,
                "there is no DDS domain {domain_id}: give one of 0 to {LAST_DOMAIN}"
            );
            let fail = || format!("cannot join DDS domain {domain_id}");
            let participant = DomainParticipant::new(u16::try_from(domain_id)?);
            let participant = participant.with_context(fail)?;
            let by_name = ALL.into_iter().map(|topic| {
                let writer = writer(&participant, topic);
                Ok((topic.name, writer.with_context(fail)?))
            });
            Ok(Self {
                writers: Writers {
                    by_name: by_name.collect::<Result<_>>()?,
                    _participant: participant,
                },
                translation: Translation::default(),
            })
        }
    }

    impl Sink for Publisher {
        fn wants(&self, channel: Channel) -> bool {
            Translation::knows(channel)
        }

        fn message(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()> {
            let Self {
                translation,
                writers,
            } = self;
            translation.message(channel, at_ns, message, writers)
        }
    }

    impl Messages for Writers {
        fn add(&mut self, topic: &'static Topic, _at_ns: u64, message: Vec<u8>) -> Result<()> {
            let found = self.by_name.iter().find(|(name, _)| *name == topic.name);
            let (name, writer) = found.context("a topic without a writer")?;
            let message = Bytes::from(message).slice(ENCAPSULATION..);
            match writer.write(message, None) {
                // Too much is on its way to a reader that takes nothing in.
                Ok(()) | Err(WriteError::WouldBlock { .. }) => Ok(()),
                Err(error) => Err(anyhow!("cannot publish `{name}`: {error}")),
            }
        }
    }

    impl fmt::Debug for Writers {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.debug_set()
                .entries(self.by_name.iter().map(|(name, _)| name))
                .finish()
        }
    }

    /// A writer for a topic, under the names that ROS gives topic and type in DDS.
    fn writer(
        participant: &DomainParticipant,
        topic: &Topic,
    ) -> Result<DataWriter<Bytes, Encoded>> {
        let quality = quality_of_service(topic.promise);
        let full_name = topic.definition.full_name();
        let kind = full_name.replace("/msg/", "::msg::dds_::") + "_";
        let name = format!("rt{}", topic.name);
        let topic = participant.create_topic(name, kind, &quality, TopicKind::NoKey)?;
        let publisher = participant.create_publisher(&quality)?;
        Ok(publisher.create_datawriter_no_key(&topic, Some(quality))?)
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
}

#[cfg(not(feature = "ros2"))]
mod publisher {
    use anyhow::{Result, bail};
    use run_log::{Channel, Sink};
    use serde_json::Value;
    use std::convert::Infallible;

    /// There is none in this build.
    #[derive(Debug)]
    pub struct Publisher(Infallible);

    impl Publisher {
        /// Always refuses.
        ///
        /// # Errors
        /// How a build that can is made.
        pub fn start(_domain_id: u32) -> Result<Self> {
            bail!(
                "this build has no publisher for ROS 2; build it with `cargo build --release -p \
                 wag --features ros2`"
            )
        }
    }

    impl Sink for Publisher {
        fn message(&mut self, _: Channel, _: u64, _: &Value) -> Result<()> {
            match self.0 {}
        }
    }
}

pub use publisher::Publisher;
