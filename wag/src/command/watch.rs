//! `wag watch`: a page in the browser that shows what runs.

use crate::cli::WatchArgs;
use crate::config;
use camera_ingest::load_camera;
use cli_output::{Failure, OrInput, Outcome, is_interrupted, output, watch_interrupts};
use serde_json::{Value, json};
use shared_types::ipc::IpcError;
use std::net::SocketAddr;
use std::time::Instant;
use studio::Preview;
use viewer::live::{Wanted, Watcher, domain_of_run};

/// How much sooner everything else gets a processor than this program.
const NICE: i32 = 10;

/// Says where the page of a command is.
pub fn announce(command: &str, url: &str, bind: SocketAddr) {
    output::object(&json!({ "ok": true, "command": command, "url": url }));
    println!("{url}\nOpen it in a browser; Ctrl-C ends it.");
    let whoever = format!("whoever reaches {} and knows this address", bind.ip());
    if !bind.ip().is_loopback() {
        eprintln!("warning: {whoever} can look on and stop the arm; nothing is encrypted");
    }
}

pub fn run(args: &WatchArgs) -> Outcome<Option<Value>> {
    let wanted = match (&args.run, &args.domain) {
        (Some(run), _) => Wanted::Domain(domain_of_run(run).or_input()?, Some(run.clone())),
        (None, Some(domain)) => Wanted::Domain(domain.clone(), None),
        (None, None) => Wanted::Newest,
    };
    if let Some(camera) = &args.camera {
        load_camera(camera).or_input()?;
    }
    let here = config::cell_here().or_input()?;
    watch_interrupts().or_failed()?;
    if args.telemetry.is_wanted() {
        return telemetry::run(&args.telemetry, wanted, here, args.seconds);
    }
    let mut preview = args.preview.then(Preview::new).transpose().or_failed()?;
    let (mut watcher, url) = Watcher::start(wanted, args.bind, here, None).map_err(|error| {
        match error.downcast_ref::<IpcError>() {
            Some(IpcError::Domain { .. }) => Failure::input(error),
            _ => Failure::of_server(error),
        }
    })?;
    // Whatever happens here may wait; what is watched may not.
    let _ = rustix::process::nice(NICE);
    let (began, span_s) = (Instant::now(), args.seconds.unwrap_or(f64::INFINITY));
    announce("watch", &url, args.bind);
    let mut named = None;
    while !is_interrupted() && began.elapsed().as_secs_f64() < span_s {
        let searched = watcher.turn().or_failed()?;
        if let Some(run) = watcher.run().filter(|run| named.as_deref() != Some(*run)) {
            eprintln!("run `{}` is shown", run.display());
            named = Some(run.to_owned());
        }
        // What is joined anew in the next turn is still what the preview looks at.
        if let Some(preview) = preview.as_mut().filter(|_| searched) {
            preview.keep(&mut watcher, args.camera.as_deref());
        }
    }
    Ok(None)
}
