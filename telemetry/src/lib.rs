//! What a running arm, its camera and its tracker publish, live for other programs.
//!
//! A program of its own attaches to the shared memory of a run as the recorder does, with the same
//! messages ([`run_log::Feed`]), and hands them to [`Sink`]s. It only reads: nothing that comes
//! from a sink's clients reaches the arm, and where it is slow it loses messages of its own.
#![cfg_attr(test, allow(clippy::float_cmp, reason = "tests compare exact numbers"))]

mod command;
mod foxglove;
mod ros2;
mod source;

pub use command::{TelemetryArgs, run};
pub use foxglove::Socket;
pub use ros2::{Domain, Publisher};
pub use run_log::Sink;
pub use source::Source;
