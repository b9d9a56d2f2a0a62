//! Shared memory: where processes meet.
//!
//! Every service is opened here, once, with its exact sizes, so that both ends
//! always agree. Patterns (pub-sub, request-response, blackboard) follow what
//! was measured of iceoryx2: publishing allocates and does file work when a
//! subscriber attaches, the blackboard does neither, so the real-time thread
//! only ever touches blackboards.
//!
//! | service | from -> to | pattern |
//! |---|---|---|
//! | [`Bus::frame_publisher`] | camera -> tracker, recorder | pub-sub of bytes, [`FrameHeader`] |
//! | [`Bus::keypoint_publisher`] | tracker -> planner, recorder | pub-sub |
//! | [`Bus::preview_publisher`] | live preview -> whoever looks on | pub-sub |
//! | [`Bus::cycle_publisher`] | controller's bridge -> recorder | pub-sub |
//! | [`Bus::joint_publisher`] | controller's bridge -> recorder | pub-sub |
//! | [`Bus::chunk_publisher`] | controller's bridge -> recorder | pub-sub of bytes: every cycle's inputs and answers |
//! | [`ControllerBoards`] | controller state out, heartbeats of operator and guardian in | blackboard |
//! | [`rpc`] | `wag` <-> camera, planner, controller, rig | request-response, streamed answers |
//!
//! Without the feature `std` only the payloads are here, plain data.
//!
//! All processes of one installation run as one user and name the same domain;
//! two domains never see each other.

#[cfg(feature = "std")]
mod boards;
#[cfg(feature = "std")]
mod bus;
#[cfg(feature = "std")]
mod bytes;
#[cfg(feature = "std")]
mod camera;
mod cause;
#[cfg(feature = "std")]
mod domain;
#[cfg(feature = "std")]
mod error;
mod input;
#[cfg(feature = "std")]
pub mod message;
mod payload;
#[cfg(feature = "std")]
mod preview;
#[cfg(feature = "std")]
pub mod rpc;
#[cfg(feature = "std")]
mod running;
#[cfg(feature = "std")]
mod sight;
#[cfg(feature = "std")]
mod slots;
#[cfg(feature = "std")]
mod sweep;

#[cfg(feature = "std")]
pub use boards::{ControllerBoards, GuardianEnd, OperatorEnd, OperatorReader, StateReader};
#[cfg(feature = "std")]
pub use bus::{
    Bus, ChunkPublisher, ChunkSubscriber, CyclePublisher, CycleSubscriber, FRAME_SERVICE,
    FramePublisher, FrameSubscriber, JOINT_SERVICE, JointPublisher, JointSubscriber,
    KEYPOINT_SERVICE, KeypointPublisher, KeypointSubscriber, PREVIEW_SERVICE, PreviewPublisher,
    PreviewSubscriber,
};
pub use cause::{CauseRecord, LimitBroken, RunCounts};
#[cfg(feature = "std")]
pub use error::IpcError;
pub use input::{
    ArmCodesRecord, CommandKind, CommandRecord, InputRecord, LinkRecord, REPORTS_PER_CYCLE, Reports,
};
pub use payload::{
    ControllerMode, ControllerState, CycleRecord, FrameHeader, GuardianBeat, JointReport,
    OperatorBeat, PAYLOAD_VERSION, PIXEL_FORMAT_YUYV,
};
#[cfg(feature = "std")]
pub use preview::{PreviewFrame, PreviewState};
#[cfg(feature = "std")]
pub use running::running_controllers;
#[cfg(feature = "std")]
pub use sweep::DomainSweep;
