//! One process's connection to shared memory, and the pub-sub services.

use super::IpcError;
use super::domain::{config_of, root_folder};
use super::payload::{CycleRecord, FrameHeader, JointReport};
use super::preview::PreviewFrame;
use crate::keypoints::KeypointFrame;
use core::fmt::Debug;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::Builder;

pub(super) type Transport = ipc::Service;

/// Publishes side-by-side frames.
pub type FramePublisher = Publisher<Transport, [u8], FrameHeader>;
/// Receives side-by-side frames.
pub type FrameSubscriber = Subscriber<Transport, [u8], FrameHeader>;
/// Publishes keypoints.
pub type KeypointPublisher = Publisher<Transport, KeypointFrame, ()>;
/// Receives keypoints.
pub type KeypointSubscriber = Subscriber<Transport, KeypointFrame, ()>;
/// Publishes what the live preview sees.
pub type PreviewPublisher = Publisher<Transport, PreviewFrame, ()>;
/// Receives what the live preview sees.
pub type PreviewSubscriber = Subscriber<Transport, PreviewFrame, ()>;
/// Publishes cycle records.
pub type CyclePublisher = Publisher<Transport, CycleRecord, ()>;
/// Receives cycle records.
pub type CycleSubscriber = Subscriber<Transport, CycleRecord, ()>;
/// Publishes joint reports.
pub type JointPublisher = Publisher<Transport, JointReport, ()>;
/// Receives joint reports.
pub type JointSubscriber = Subscriber<Transport, JointReport, ()>;
/// Publishes the chunks of a recording.
pub type ChunkPublisher = Publisher<Transport, [u8], ()>;
/// Receives the chunks of a recording.
pub type ChunkSubscriber = Subscriber<Transport, [u8], ()>;

/// Service of [`Bus::frame_publisher`].
pub const FRAME_SERVICE: &str = "wag/v1/camera/frames";
/// Service of [`Bus::keypoint_publisher`].
pub const KEYPOINT_SERVICE: &str = "wag/v1/camera/keypoints";
/// Service of [`Bus::preview_publisher`].
// Version 2: its payload carries a keypoint frame.
pub const PREVIEW_SERVICE: &str = "wag/v2/camera/preview";
/// Service of [`Bus::joint_publisher`].
pub const JOINT_SERVICE: &str = "wag/v1/controller/joints";

/// A service: its name, and how many samples are kept for a subscriber, and borrowed by it.
type Topic = (&'static str, usize, usize);

/// What a slow subscriber may lag behind before it loses the oldest.
const FRAMES: Topic = (FRAME_SERVICE, 16, 2);
/// A whole wiggle and more.
const KEYPOINTS: Topic = (KEYPOINT_SERVICE, 1024, 2);
/// A second of them. Who comes late wants the newest.
const PREVIEW: Topic = (PREVIEW_SERVICE, 64, 2);
/// Four seconds.
const CYCLES: Topic = ("wag/v1/controller/cycles", 1024, 2);
/// Four seconds.
const JOINTS: Topic = (JOINT_SERVICE, 1024, 2);
/// Ten to the second: twelve seconds.
const CHUNKS: Topic = ("wag/v1/controller/recording", 128, 1);

/// The run that a record belongs to, its recorder, a page that looks on, the one that works
/// on frames, the one that previews them, a recorder that joined late, a program that tells
/// others, and one more.
const SUBSCRIBERS: usize = 8;
/// Processes that have opened a service.
const NODES: usize = 16;

/// One process's connection to a shared-memory domain.
///
/// Not `Send`: each thread opens its own, before its loop begins. Not RT-safe.
#[derive(Debug)]
pub struct Bus {
    node: Node<Transport>,
}

pub(super) fn open_error<E: Debug>(service: &'static str) -> impl Fn(E) -> IpcError {
    move |e| IpcError::Open {
        service,
        reason: format!("{e:?}"),
    }
}

impl Bus {
    /// Joins `domain`. Files left by killed processes of the same user are
    /// removed on the way. [`IpcError::Domain`] for a bad name.
    pub fn join(domain: &str) -> Result<Self, IpcError> {
        let config = config_of(domain)?;
        let root = root_folder()?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Transport>()
            .map_err(|e| IpcError::join(domain, &root, e))?;
        Ok(Self { node })
    }

    /// Removes what killed processes of this domain left behind.
    pub fn remove_leftovers(&self) {
        let _ = self.node.try_cleanup_dead_nodes();
    }

    pub(super) fn service(
        &self,
        name: &'static str,
    ) -> Result<iceoryx2::service::builder::Builder<Transport>, IpcError> {
        let name: ServiceName = name.try_into().map_err(open_error(name))?;
        Ok(self.node.service_builder(&name))
    }
}

/// Publishers and subscribers. There is one publisher of a kind per domain; a slow
/// subscriber loses the oldest and never slows the publisher. Each fails with
/// [`IpcError::Open`], for instance where another publishes already.
impl Bus {
    fn topic<P: Debug + IceoryxSend + ?Sized, H: Debug + ZeroCopySend>(
        &self,
        (name, kept, borrowed): Topic,
    ) -> Result<Builder<P, H, Transport>, IpcError> {
        let service = self.service(name)?.publish_subscribe::<P>();
        Ok(service
            .user_header::<H>()
            .max_publishers(1)
            .max_subscribers(SUBSCRIBERS)
            .max_nodes(NODES)
            .subscriber_max_buffer_size(kept)
            .subscriber_max_borrowed_samples(borrowed)
            .history_size(0)
            .enable_safe_overflow(true))
    }

    fn publisher<T: Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic,
    ) -> Result<Publisher<Transport, T, ()>, IpcError> {
        let service = self.topic::<T, ()>(topic)?.open_or_create();
        let service = service.map_err(open_error(topic.0))?;
        let port = service.publisher_builder().create();
        port.map_err(open_error(topic.0))
    }

    fn subscriber<T: Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic,
    ) -> Result<Subscriber<Transport, T, ()>, IpcError> {
        let service = self.topic::<T, ()>(topic)?.open_or_create();
        let service = service.map_err(open_error(topic.0))?;
        let port = service.subscriber_builder().buffer_size(topic.1).create();
        port.map_err(open_error(topic.0))
    }

    fn bytes_publisher<H: Debug + ZeroCopySend + Default + 'static>(
        &self,
        topic: Topic,
        most_bytes: usize,
    ) -> Result<Publisher<Transport, [u8], H>, IpcError> {
        let service = self.topic::<[u8], H>(topic)?.open_or_create();
        let service = service.map_err(open_error(topic.0))?;
        let port = service.publisher_builder().max_loaned_samples(1);
        let port = port.initial_max_slice_len(most_bytes).create();
        port.map_err(open_error(topic.0))
    }

    fn bytes_subscriber<H: Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic,
    ) -> Result<Subscriber<Transport, [u8], H>, IpcError> {
        let service = self.topic::<[u8], H>(topic)?.open_or_create();
        let service = service.map_err(open_error(topic.0))?;
        let port = service.subscriber_builder().buffer_size(topic.1).create();
        port.map_err(open_error(topic.0))
    }

    /// Publishes frames of at most `frame_bytes` bytes.
    pub fn frame_publisher(&self, frame_bytes: usize) -> Result<FramePublisher, IpcError> {
        self.bytes_publisher(FRAMES, frame_bytes)
    }

    /// Receives frames.
    pub fn frame_subscriber(&self) -> Result<FrameSubscriber, IpcError> {
        self.bytes_subscriber(FRAMES)
    }

    /// Publishes chunks of a recording, of at most `chunk_bytes` bytes; the bridge thread's.
    pub fn chunk_publisher(&self, chunk_bytes: usize) -> Result<ChunkPublisher, IpcError> {
        self.bytes_publisher(CHUNKS, chunk_bytes)
    }

    /// Receives chunks of a recording.
    pub fn chunk_subscriber(&self) -> Result<ChunkSubscriber, IpcError> {
        self.bytes_subscriber(CHUNKS)
    }

    /// Publishes keypoints.
    pub fn keypoint_publisher(&self) -> Result<KeypointPublisher, IpcError> {
        self.publisher(KEYPOINTS)
    }

    /// Receives keypoints.
    pub fn keypoint_subscriber(&self) -> Result<KeypointSubscriber, IpcError> {
        self.subscriber(KEYPOINTS)
    }

    /// Publishes what the live preview sees.
    pub fn preview_publisher(&self) -> Result<PreviewPublisher, IpcError> {
        self.publisher(PREVIEW)
    }

    /// Receives what the live preview sees.
    pub fn preview_subscriber(&self) -> Result<PreviewSubscriber, IpcError> {
        self.subscriber(PREVIEW)
    }

    /// Publishes cycle records; the bridge thread's.
    pub fn cycle_publisher(&self) -> Result<CyclePublisher, IpcError> {
        self.publisher(CYCLES)
    }

    /// Receives cycle records.
    pub fn cycle_subscriber(&self) -> Result<CycleSubscriber, IpcError> {
        self.subscriber(CYCLES)
    }

    /// Publishes joint reports; the bridge thread's.
    pub fn joint_publisher(&self) -> Result<JointPublisher, IpcError> {
        self.publisher(JOINTS)
    }

    /// Receives joint reports.
    pub fn joint_subscriber(&self) -> Result<JointSubscriber, IpcError> {
        self.subscriber(JOINTS)
    }
}
