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

#[cfg(test)]
mod tests {
    use super::report::{ForceReport, NormalReport, RealtimeReport, RichReport};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn arbitrary_bytes_never_panic_and_never_fill_a_buffer(
            bytes in prop::collection::vec(any::<u8>(), 0..6000),
            (register, status) in any::<(u8, u8)>(),
            text in ".{0,60}",
        ) {
            let _ = ArmVersion::parse(&text).map(|v| v.check());
            let (mut frames, mut reports) = (FrameReader::new(), ReportReader::new());
            for chunk in bytes.chunks(700) {
                frames.feed(chunk);
                reports.feed(chunk);
                while let Ok(Some(frame)) = frames.next_frame() {
                    let _ = (frame.as_request(), frame.as_reply());
                }
                while let Ok(Some(_)) = reports.next_report() {}
                prop_assert!(frames.next_frame().is_err() || !frames.space().is_empty());
                prop_assert!(reports.next_report().is_err() || !reports.space().is_empty());
            }
            // Reports and messages are shorter than that.
            let bytes = &bytes[..bytes.len() % 900];
            let _ = (ForceReport::parse(bytes), NormalReport::parse(bytes));
            let _ = (RichReport::parse(bytes), RealtimeReport::parse(bytes));
            let (parameters, data) = bytes.split_at(bytes.len() % 120);
            if let Ok(command) = Command::parse(register, parameters) {
                prop_assert_eq!(command.register().code(), register);
                prop_assert!(command.is_well_formed());
                let reply = Reply {
                    transaction: 1,
                    protocol: Protocol::Private,
                    register,
                    status: Status(status),
                    data,
                };
                let _ = ReplyData::parse(&command, &reply);
            }
        }
    }
}
