//! `wag watch`: a page in the browser that shows what runs.

use crate::cli::WatchArgs;
use crate::watch::{PreviewChild, Wanted, Watcher, domain_of_run};
use anyhow::anyhow;
use camera_ingest::load_camera;
use cli_output::output;
use cli_output::{Failure, OrInput, Outcome};
use cli_output::{interrupted, watch_interrupts};
use serde_json::{Value, json};
use shared_types::ipc::IpcError;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// How much sooner everything else gets a processor than this program.
const NICE: i32 = 10;

pub fn run(args: &WatchArgs, quiet: bool) -> Outcome<Option<Value>> {
    if args.seconds.is_some_and(|s| !s.is_finite() || s <= 0.0) {
        return Err(Failure::input(anyhow!(
            "--seconds must be a number above zero"
        )));
    }
    let wanted = match (&args.run, &args.domain) {
        (Some(run), _) => Wanted::Domain(domain_of_run(run).or_input()?, Some(run.clone())),
        (None, Some(domain)) => Wanted::Domain(domain.clone(), None),
        (None, None) => Wanted::Newest,
    };
    if let Some(camera) = &args.camera {
        load_camera(camera).or_input()?;
    }
    watch_interrupts().or_failed()?;
    let preview = args.preview.then(|| PreviewChild::new(args.camera.clone()));
    let preview = preview.transpose().or_failed()?;
    let (mut watcher, url) =
        Watcher::start(wanted, args.bind, preview).map_err(|error| {
            match error.downcast_ref::<IpcError>() {
                Some(IpcError::Domain { .. }) => Failure::input(error),
                _ => Failure::failed(error),
            }
        })?;
    // Whatever happens here may wait; what is watched may not.
    let _ = rustix::process::nice(NICE);
    let began = Instant::now();
    if quiet {
        output::object(&json!({ "ok": true, "command": "watch", "url": url }));
    } else {
        println!("{url}\nOpen it in a browser; Ctrl-C ends it.");
    }
    if !args.bind.ip().is_loopback() {
        eprintln!(
            "warning: whoever reaches {} and knows this address can look on and stop the arm; \
             nothing is encrypted",
            args.bind.ip()
        );
    }
    let over = || {
        args.seconds
            .is_some_and(|s| began.elapsed().as_secs_f64() >= s)
    };
    while !interrupted().load(Ordering::SeqCst) && !over() {
        watcher.turn().or_failed()?;
    }
    Ok(None)
}
