//! `wag watch --foxglove` and `--ros2`, as they are typed.

use clap::Args;
use cli_output::{Failure, Outcome};
use std::net::SocketAddr;

/// Whom to tell.
#[derive(Debug, Clone, Args)]
pub struct TelemetryArgs {
    /// Instead of the page, a socket for the application Foxglove, with the topics of run.mcap:
    /// it can be looked at, and nothing more. Every program of this machine can look on, a page in
    /// its browser too; anything but loopback lets other machines look on, without encryption. In
    /// builds with `--features foxglove` only.
    #[arg(
        long,
        value_name = "ADDR:PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "127.0.0.1:8765",
        value_parser = address,
        conflicts_with_all = ["bind", "preview", "camera"]
    )]
    pub foxglove: Option<SocketAddr>,
    /// Instead of the page, a publisher for ROS 2 in this DDS domain, with the topics of
    /// `wag export ros2`; default: ROS_DOMAIN_ID, or 0. Whoever is in the same network can look on,
    /// without encryption, and nothing more. In builds with `--features ros2` only.
    #[arg(
        long,
        value_name = "DOMAIN",
        require_equals = true,
        conflicts_with_all = ["bind", "preview", "camera"]
    )]
    pub ros2: Option<Option<u32>>,
}

impl TelemetryArgs {
    /// Whether anybody is to be told anything.
    #[must_use]
    pub fn is_wanted(&self) -> bool {
        self.foxglove.is_some() || self.ros2.is_some()
    }

    /// Refuses what this build cannot do.
    pub(crate) fn check(&self) -> Outcome {
        let lacks_foxglove = self.foxglove.is_some() && !cfg!(feature = "foxglove");
        let lacks_ros2 = self.ros2.is_some() && !cfg!(feature = "ros2");
        if lacks_foxglove {
            return Err(Failure::not_built("serve Foxglove", "foxglove"));
        }
        if lacks_ros2 {
            return Err(Failure::not_built("publish for ROS 2", "ros2"));
        }
        Ok(())
    }
}

/// An address with its port, or a port of this machine alone.
fn address(text: &str) -> Result<SocketAddr, String> {
    let port = text.strip_prefix("localhost:").unwrap_or(text);
    let here = |port: u16| SocketAddr::from(([127, 0, 0, 1], port));
    let address = port.parse().map(here).ok().or_else(|| text.parse().ok());
    address.ok_or_else(|| "give ADDR:PORT or PORT, such as 127.0.0.1:8765 or 8765".to_owned())
}

/// Would tell the messages of a run, in a build with a sink.
///
/// # Errors
/// What is wanted is not in this build: how one that has it is made.
#[cfg(not(any(feature = "foxglove", feature = "ros2")))]
pub fn run(
    args: &TelemetryArgs,
    _wanted: viewer::live::Wanted,
    _here: run_log::CellHere,
    _seconds: Option<f64>,
) -> Outcome<Option<serde_json::Value>> {
    args.check().map(|()| None)
}
