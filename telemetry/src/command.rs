//! `wag watch --foxglove` and `--ros2`, as they run.

use crate::args::TelemetryArgs;
#[cfg(feature = "ros2")]
use crate::domain::Domain;
#[cfg(feature = "foxglove")]
use crate::foxglove::Socket;
#[cfg(feature = "ros2")]
use crate::ros2::Publisher;
use crate::source::Source;
use anyhow::Result;
use cli_output::{OrInput, Outcome, is_interrupted, output, println};
use run_log::{CellHere, Channel, Sink};
use serde_json::{Value, json};
use std::time::{Duration, Instant};
use viewer::live::Wanted;

/// Pause between two looks at what has arrived.
const TURN: Duration = Duration::from_millis(10);
/// How much sooner everything else gets a processor than this program.
const NICE: i32 = 10;

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
/// What is wanted is not in this build, the domain cannot be joined, or there is no place to serve at.
pub fn run(
    args: &TelemetryArgs,
    wanted: Wanted,
    here: CellHere,
    seconds: Option<f64>,
) -> Outcome<Option<Value>> {
    args.check()?;
    // Whatever happens here may wait; what is told of may not. Threads have what the one that starts
    // them has.
    let _ = rustix::process::nice(NICE);
    let mut sinks = Sinks {
        sinks: Vec::new(),
        failed: None,
    };
    let mut report = json!({ "ok": true, "command": "watch" });
    let (mut said, mut warned) = (Vec::new(), Vec::new());
    #[cfg(feature = "ros2")]
    let domain = args.ros2.map(Domain::of).transpose().or_input()?;
    #[cfg(feature = "foxglove")]
    if let Some(bind) = args.foxglove {
        let socket = Socket::start(bind)?;
        let url = socket.url();
        said.push(format!(
            "{url}\nOpen it in Foxglove (\"Open connection\"); Ctrl-C ends it."
        ));
        if !bind.ip().is_loopback() {
            warned.push(format!("whoever reaches {} can look on", bind.ip()));
        }
        report["foxglove"] = url.into();
        sinks.sinks.push(Box::new(socket));
    }
    #[cfg(feature = "ros2")]
    if let Some(domain) = domain {
        let Domain { id, is_local } = domain;
        sinks.sinks.push(Box::new(Publisher::start(domain)?));
        said.push(format!(
            "topics of ROS 2 in DDS domain {id}; Ctrl-C ends it."
        ));
        if !is_local {
            warned.push("whoever is in this network can look on".to_owned());
        }
        report["ros2"] = json!({ "domain": id, "is_local": is_local });
    }
    let mut source = Source::new(wanted, here).or_input()?;
    for line in &said {
        println!("{line}");
    }
    for line in &warned {
        eprintln!("warning: {line}");
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
