//! `wag watch --foxglove` and `--ros2`, as they are typed and run.

use crate::foxglove::Socket;
use crate::ros2::{Domain, Publisher};
use crate::source::Source;
use anyhow::Result;
use clap::Args;
use cli_output::{OrInput, Outcome, is_interrupted, output, println};
use run_log::{CellHere, Channel, Sink};
use serde_json::{Value, json};
use std::net::SocketAddr;
use std::time::{Duration, Instant};
use viewer::live::Wanted;

/// Pause between two looks at what has arrived.
const TURN: Duration = Duration::from_millis(10);
/// How much sooner everything else gets a processor than this program.
const NICE: i32 = 10;

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
}

/// An address with its port, or a port of this machine alone.
fn address(text: &str) -> Result<SocketAddr, String> {
    let port = text.strip_prefix("localhost:").unwrap_or(text);
    let here = |port: u16| SocketAddr::from(([127, 0, 0, 1], port));
    let address = port.parse().map(here).ok().or_else(|| text.parse().ok());
    address.ok_or_else(|| "give ADDR:PORT or PORT, such as 127.0.0.1:8765 or 8765".to_owned())
}

/// All sinks of a command. One that fails is told nothing more, and ends the command.
struct Sinks {
    sinks: Vec<Box<dyn Sink>>,
    failed: Option<anyhow::Error>,
}

impl Sinks {
    fn each(&mut self, tell: impl Fn(&mut dyn Sink) -> Result<()>) {
        let failed = &mut self.failed;
        self.sinks.retain_mut(|sink| {
            let told = tell(sink.as_mut());
            told.map_err(|error| *failed = Some(error)).is_ok()
        });
    }
}

impl Sink for Sinks {
    fn wants(&self, channel: Channel) -> bool {
        self.sinks.iter().any(|sink| sink.wants(channel))
    }

    fn message(&mut self, channel: Channel, at_ns: u64, message: &Value) -> Result<()> {
        self.each(|sink| sink.message(channel, at_ns, message));
        Ok(())
    }

    fn begin_anew(&mut self) -> Result<()> {
        self.each(|sink| sink.begin_anew());
        Ok(())
    }
}

/// Tells the messages of the run that is wanted until Ctrl-C, or for a while.
///
/// # Errors
/// The domain cannot be joined, or there is no place to serve at.
pub fn run(
    args: &TelemetryArgs,
    wanted: Wanted,
    here: CellHere,
    seconds: Option<f64>,
) -> Outcome<Option<Value>> {
    // Whatever happens here may wait; what is told of may not. Threads have what the one that starts
    // them has.
    let _ = rustix::process::nice(NICE);
    let domain = args.ros2.map(Domain::of).transpose().or_input()?;
    let mut sinks = Sinks {
        sinks: Vec::new(),
        failed: None,
    };
    let mut report = json!({ "ok": true, "command": "watch" });
    if let Some(bind) = args.foxglove {
        let socket = Socket::start(bind)?;
        report["foxglove"] = socket.url().into();
        sinks.sinks.push(Box::new(socket));
    }
    if let Some(domain) = domain {
        sinks.sinks.push(Box::new(Publisher::start(domain)?));
        report["ros2"] = json!({ "domain": domain.id, "is_local": domain.is_local });
    }
    let mut source = Source::new(wanted, here).or_input()?;
    if let (Some(bind), Some(url)) = (args.foxglove, report["foxglove"].as_str()) {
        println!("{url}\nOpen it in Foxglove (\"Open connection\"); Ctrl-C ends it.");
        if !bind.ip().is_loopback() {
            eprintln!("warning: whoever reaches {} can look on", bind.ip());
        }
    }
    if let Some(Domain { id, is_local }) = domain {
        println!("topics of ROS 2 in DDS domain {id}; Ctrl-C ends it.");
        if !is_local {
            eprintln!("warning: whoever is in this network can look on");
        }
    }
    output::object(&report);
    let (began, span_s) = (Instant::now(), seconds.unwrap_or(f64::INFINITY));
    let mut named = None;
    while !is_interrupted() && began.elapsed().as_secs_f64() < span_s {
        source.turn(&mut sinks).or_failed()?;
        if let Some(failed) = sinks.failed.take() {
            return Err(failed).or_failed();
        }
        if let Some(run) = source.run().filter(|run| named.as_deref() != Some(*run)) {
            eprintln!("run `{}` is shown", run.display());
            named = Some(run.to_owned());
        }
        std::thread::sleep(TURN);
    }
    Ok(None)
}
