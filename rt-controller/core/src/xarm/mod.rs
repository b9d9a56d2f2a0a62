//! The xArm controller's wire protocol, without any I/O.
//!
//! Bytes in, values out, and back: nothing here owns a socket, reads a clock
//! or allocates, so the same code serves the real-time client, the simulated
//! controller and replay. Both directions of every message are here, because
//! a codec that can only be half used can only be half tested.
//!
//! - [`frame`]: the request and reply frames of the command port
//! - [`command`]: typed requests; [`reply`]: typed answers to them
//! - [`report`]: the frames the controller pushes on ports 30000 to 30003
//! - [`stream`]: reassembles frames from a TCP stream
//! - [`version`]: what an arm's version text says about its reports and ranges
//! - [`register`], [`status`], [`error_code`]: the words used by all of them
//!
//! Values are SI on this side (m, rad, s, kg); the wire's millimetres exist
//! only inside this module. Everything here is RT-safe: bounded time, no
//! allocation, no panic on any input.
//!
//! Source: official SDK 1.18.4 (Python) and 1.15.2 (C++), UFACTORY manuals.
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

mod bytes;
pub mod command;
pub mod error_code;
pub mod frame;
pub mod pose;
pub mod register;
pub mod reply;
pub mod report;
pub mod status;
pub mod stream;
pub mod version;

pub use bytes::EmitError;
pub use command::{Command, CommandError, JointQuery, StateRequest};
pub use error_code::ErrorCode;
pub use frame::{Protocol, Reply, Request};
pub use pose::TcpPose;
pub use register::Register;
pub use reply::{ReplyData, ReplyError};
pub use status::{ArmState, Mode, Status};
pub use stream::{BrokenStream, FrameReader, ReportReader};
pub use version::{ArmVersion, Firmware, VersionError};

/// TCP port of the command server.
pub const COMMAND_PORT: u16 = 502;
/// TCP ports of the report servers: real-time (250 Hz), normal (5 Hz), rich
/// (5 Hz) and real (100 Hz).
pub const REPORT_PORTS: [u16; 4] = [30000, 30001, 30002, 30003];
