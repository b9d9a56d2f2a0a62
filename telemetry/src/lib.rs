//! What a running arm, its camera and its tracker publish, live for other programs.
//!
//! A program of its own attaches to the shared memory of a run as the recorder does, with the same
//! messages ([`run_log::Feed`]), and hands them to [`run_log::Sink`]s. It only reads: nothing that comes
//! from a sink's clients reaches the arm, and where it is slow it loses messages of its own.
//!
//! Each sink is a feature, because each needs many libraries of its own; without any, [`run()`]
//! refuses.

mod args;
#[cfg(any(feature = "foxglove", feature = "ros2"))]
mod command;
#[cfg(feature = "ros2")]
mod domain;
#[cfg(feature = "foxglove")]
mod foxglove;
#[cfg(feature = "ros2")]
mod ros2;
#[cfg(any(feature = "foxglove", feature = "ros2"))]
mod source;

pub use args::TelemetryArgs;
#[cfg(not(any(feature = "foxglove", feature = "ros2")))]
pub use args::run;
#[cfg(any(feature = "foxglove", feature = "ros2"))]
pub use command::run;
#[cfg(feature = "ros2")]
pub use domain::Domain;
#[cfg(feature = "foxglove")]
pub use foxglove::Socket;
#[cfg(feature = "ros2")]
pub use ros2::Publisher;
#[cfg(any(feature = "foxglove", feature = "ros2"))]
pub use source::Source;
