//! `wag process`: one of the processes in the foreground.
//!
//! `wag` starts its processes this way, so that one installed file is enough.
//! A process ends in order on SIGTERM, SIGINT, or when its parent is gone.

use crate::cli::{ProcessArgs, ProcessName};
use anyhow::Context;
use cli_output::{OrInput, Outcome, interrupted, watch_interrupts, watch_parent};
use rt_controller::ControllerConfig;
use run_log::files;
use serde::de::DeserializeOwned;
use shared_types::ipc::DomainSweep;
use std::time::Duration;
use viewer::report::simulated_rope;

/// How long an orderly end may take before the process simply exits.
const END_WITHIN: Duration = Duration::from_millis(1200);
/// The same where an arm may have to be braked first.
const BRAKE_WITHIN: Duration = Duration::from_millis(4500);
/// The same where a file must be finished.
const FINISH_WITHIN: Duration = Duration::from_secs(19);
/// The lowest priority there is.
const LOWEST: i32 = 19;

/// How much longer than its parent a recorder lives: the controller then brakes.
const OUTLIVES: Duration = Duration::from_secs(2);

fn read<T: DeserializeOwned>(args: &ProcessArgs) -> Outcome<T> {
    let text = files::read_text(&args.config).or_input()?;
    toml::from_str(&text)
        .with_context(|| format!("configuration `{}`", args.config.display()))
        .or_input()
}

/// The controller's configuration, whose files lie beside it.
fn controller(args: &ProcessArgs) -> Outcome<ControllerConfig> {
    ControllerConfig::load(&args.config).or_input()
}

/// Does a process's work with its configuration.
fn work<T: DeserializeOwned, E: Into<anyhow::Error>>(
    args: &ProcessArgs,
    work: impl FnOnce(T) -> Result<(), E>,
) -> Outcome {
    work(read(args)?).or_failed()
}

/// Everything else goes first: what this process makes is only looked at.
fn give_way() {
    if let Err(reason) = rustix::process::nice(LOWEST) {
        tracing::warn!(%reason, "the preview runs with ordinary priority");
    }
}

pub fn run(args: &ProcessArgs) -> Outcome {
    watch_interrupts().or_failed()?;
    let (end_within, outlives) = match args.name {
        ProcessName::RtController | ProcessName::Guardian => (BRAKE_WITHIN, Duration::ZERO),
        ProcessName::Recorder => (FINISH_WITHIN, OUTLIVES),
        ProcessName::Rig
        | ProcessName::Camera
        | ProcessName::CameraIngest
        | ProcessName::Preview
        | ProcessName::Planner => (END_WITHIN, Duration::ZERO),
    };
    watch_parent(args.parent, outlives, end_within).or_failed()?;
    let stop = interrupted();
    // Dropped after everything of the process that uses the domain.
    let domain = read::<toml::Table>(args)?;
    let domain = domain.get("domain").and_then(toml::Value::as_str);
    let _sweep = domain.map(DomainSweep::new);
    match args.name {
        ProcessName::Rig => work(args, |c| rig_sim::run(&c, stop)),
        ProcessName::RtController => rt_controller::run(controller(args)?, stop).or_failed(),
        ProcessName::Guardian => rt_controller::guardian::run(&controller(args)?, stop).or_failed(),
        ProcessName::Camera => work(args, |c| camera_ingest::live::run(&c, stop)),
        ProcessName::CameraIngest => work(args, |c| camera_ingest::process::run(&c, stop)),
        ProcessName::Preview => {
            give_way();
            work(args, |c| camera_ingest::preview::run(&c, stop))
        }
        ProcessName::Planner => work(args, |c| planner::service::run(&c, stop)),
        ProcessName::Recorder => work(args, |c| run_log::record(&c, simulated_rope, stop)),
    }
}
