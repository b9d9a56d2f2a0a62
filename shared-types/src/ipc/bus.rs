//! One process's connection to shared memory, and the pub-sub services.

use super::IpcError;
use super::domain::{config_of, root_folder};
use super::payload::{CycleRecord, FrameHeader, JointReport};
use super::preview::PreviewFrame;
use crate::keypoints::KeypointFrame;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::prelude::*;
use iceoryx2::service::port_factory::publish_subscribe;

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
const RECORDING: &str = "wag/v1/controller/recording";

/// A service of records: its name, and how many are kept for a subscriber.
type Topic = (&'static str, usize);

/// A whole wiggle and more.
const KEYPOINTS: Topic = (KEYPOINT_SERVICE, 1024);
/// A second of them. Who comes late wants the newest.
const PREVIEW: Topic = (PREVIEW_SERVICE, 64);
/// Four seconds.
const CYCLES: Topic = ("wag/v1/controller/cycles", 1024);
/// Four seconds.
const JOINTS: Topic = (JOINT_SERVICE, 1024);

/// The run that a record belongs to, its recorder, a page that looks on, the one that works
/// on frames or previews them, and a recorder that joined late, with its exact recording.
const SUBSCRIBERS: usize = 6;
/// Processes that have opened a service.
const NODES: usize = 10;
/// Frames a slow subscriber may lag behind before it loses the oldest.
const FRAME_BUFFER: usize = 16;
/// Chunks of a recording kept for a subscriber, ten to the second: twelve seconds.
const CHUNK_BUFFER: usize = 128;

/// One process's connection to a shared-memory domain.
///
/// Not `Send`: each thread opens its own, before its loop begins. Not RT-safe.
#[derive(Debug)]
pub struct Bus {
    node: Node<Transport>,
}

pub(super) fn open_error<E: core::fmt::Debug>(service: &'static str) -> impl Fn(E) -> IpcError {
    move |e| IpcError::Open {
        service,
        reason: format!("{e:?}"),
    }
}

impl Bus {
    /// Joins `domain`. Files left by killed processes of the same user are
    /// removed on the way.
    ///
    /// # Errors
    /// [`IpcError::Domain`] for a bad name, [`IpcError::Folder`] without a folder
    /// of this user's own, [`IpcError::Join`] otherwise.
    pub fn join(domain: &str) -> Result<Self, IpcError> {
        let config = config_of(domain)?;
        let root = root_folder()?;
        let fail = |reason: String| IpcError::Join {
            domain: domain.to_owned(),
            folder: root,
            reason,
        };
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Transport>()
            .map_err(|e| fail(format!("{e:?}")))?;
        Ok(Self { node })
    }

    /// Removes what killed processes of this domain left behind.
    pub fn remove_leftovers(&self) {
        let _ = self.node.try_cleanup_dead_nodes();
    }

    fn name(service: &'static str) -> Result<ServiceName, IpcError> {
        service.try_into().map_err(open_error(service))
    }

    pub(super) fn service(
        &self,
        name: &'static str,
    ) -> Result<iceoryx2::service::builder::Builder<Transport>, IpcError> {
        Ok(self.node.service_builder(&Self::name(name)?))
    }

    fn frames(
        &self,
    ) -> Result<publish_subscribe::PortFactory<Transport, [u8], FrameHeader>, IpcError> {
        self.service(FRAME_SERVICE)?
            .publish_subscribe::<[u8]>()
            .user_header::<FrameHeader>()
            .max_publishers(1)
            .max_subscribers(SUBSCRIBERS)
            .max_nodes(NODES)
            .subscriber_max_buffer_size(FRAME_BUFFER)
            .subscriber_max_borrowed_samples(2)
            .history_size(0)
            .enable_safe_overflow(true)
            .open_or_create()
            .map_err(open_error(FRAME_SERVICE))
    }

    /// Publishes frames of at most `frame_bytes` bytes. One per domain.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn frame_publisher(&self, frame_bytes: usize) -> Result<FramePublisher, IpcError> {
        self.frames()?
            .publisher_builder()
            .initial_max_slice_len(frame_bytes)
            .max_loaned_samples(1)
            .create()
            .map_err(open_error(FRAME_SERVICE))
    }

    /// Receives frames; a slow reader loses the oldest, never slows the camera.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn frame_subscriber(&self) -> Result<FrameSubscriber, IpcError> {
        self.frames()?
            .subscriber_builder()
            .buffer_size(FRAME_BUFFER)
            .create()
            .map_err(open_error(FRAME_SERVICE))
    }

    fn records<T: core::fmt::Debug + ZeroCopySend + 'static>(
        &self,
        (name, buffer): Topic,
    ) -> Result<publish_subscribe::PortFactory<Transport, T, ()>, IpcError> {
        self.service(name)?
            .publish_subscribe::<T>()
            .max_publishers(1)
            .max_subscribers(SUBSCRIBERS)
            .max_nodes(NODES)
            .subscriber_max_buffer_size(buffer)
            .subscriber_max_borrowed_samples(2)
            .history_size(0)
            .enable_safe_overflow(true)
            .open_or_create()
            .map_err(open_error(name))
    }

    fn publisher<T: core::fmt::Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic,
    ) -> Result<Publisher<Transport, T, ()>, IpcError> {
        let service = self.records(topic)?;
        let port = service.publisher_builder().create();
        port.map_err(open_error(topic.0))
    }

    fn subscriber<T: core::fmt::Debug + ZeroCopySend + 'static>(
        &self,
        topic: Topic,
    ) -> Result<Subscriber<Transport, T, ()>, IpcError> {
        let service = self.records(topic)?;
        let port = service.subscriber_builder().buffer_size(topic.1).create();
        port.map_err(open_error(topic.0))
    }

    /// Publishes keypoints. One per domain.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn keypoint_publisher(&self) -> Result<KeypointPublisher, IpcError> {
        self.publisher(KEYPOINTS)
    }

    /// Receives keypoints.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn keypoint_subscriber(&self) -> Result<KeypointSubscriber, IpcError> {
        self.subscriber(KEYPOINTS)
    }

    /// Publishes what the live preview sees. One per domain.
    ///
    /// # Errors
    /// [`IpcError::Open`], for instance when another preview runs.
    pub fn preview_publisher(&self) -> Result<PreviewPublisher, IpcError> {
        self.publisher(PREVIEW)
    }

    /// Receives what the live preview sees; a slow reader loses the oldest.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn preview_subscriber(&self) -> Result<PreviewSubscriber, IpcError> {
        self.subscriber(PREVIEW)
    }

    /// Publishes cycle records. One per domain; the bridge thread's.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn cycle_publisher(&self) -> Result<CyclePublisher, IpcError> {
        self.publisher(CYCLES)
    }

    /// Receives cycle records.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn cycle_subscriber(&self) -> Result<CycleSubscriber, IpcError> {
        self.subscriber(CYCLES)
    }

    /// Publishes joint reports. One per domain; the bridge thread's.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn joint_publisher(&self) -> Result<JointPublisher, IpcError> {
        self.publisher(JOINTS)
    }

    /// Receives joint reports.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn joint_subscriber(&self) -> Result<JointSubscriber, IpcError> {
        self.subscriber(JOINTS)
    }

    fn chunks(&self) -> Result<publish_subscribe::PortFactory<Transport, [u8], ()>, IpcError> {
        self.service(RECORDING)?
            .publish_subscribe::<[u8]>()
            .max_publishers(1)
            .max_subscribers(SUBSCRIBERS)
            .max_nodes(NODES)
            .subscriber_max_buffer_size(CHUNK_BUFFER)
            .subscriber_max_borrowed_samples(1)
            .history_size(0)
            .enable_safe_overflow(true)
            .open_or_create()
            .map_err(open_error(RECORDING))
    }

    /// Publishes chunks of a recording, of at most `chunk_bytes` bytes. One per
    /// domain; the bridge thread's.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn chunk_publisher(&self, chunk_bytes: usize) -> Result<ChunkPublisher, IpcError> {
        self.chunks()?
            .publisher_builder()
            .initial_max_slice_len(chunk_bytes)
            .max_loaned_samples(1)
            .create()
            .map_err(open_error(RECORDING))
    }

    /// Receives chunks of a recording; a slow reader loses the oldest, never
    /// slows the controller.
    ///
    /// # Errors
    /// [`IpcError::Open`].
    pub fn chunk_subscriber(&self) -> Result<ChunkSubscriber, IpcError> {
        self.chunks()?
            .subscriber_builder()
            .buffer_size(CHUNK_BUFFER)
            .create()
            .map_err(open_error(RECORDING))
    }
}
