//! `wag watch`: a page in the browser that shows what runs.

use crate::cli::WatchArgs;
use crate::config;
use crate::session::{ProcessSpec, Supervisor};
use anyhow::Context;
use arm_model::Cell;
use camera_ingest::load_camera;
use camera_ingest::preview::PreviewConfig;
use cli_output::{Failure, OrInput, Outcome, interrupted, output, watch_interrupts};
use run_log::files;
use serde_json::{Value, json};
use shared_types::ipc::IpcError;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;
use viewer::live::{PreviewChild, PreviewProcess, Wanted, Watcher, domain_of_run};

/// How much sooner everything else gets a processor than this program.
const NICE: i32 = 10;

/// `wag process preview` as a child.
#[derive(Debug)]
struct Preview {
    process: Supervisor,
    /// Its configuration and log.
    folder: tempfile::TempDir,
}

impl Preview {
    fn new() -> anyhow::Result<Self> {
        let folder = tempfile::Builder::new().prefix("wag-preview-").tempdir();
        Ok(Self {
            process: Supervisor::default(),
            folder: folder.context("cannot make a folder for the preview's configuration")?,
        })
    }
}

impl PreviewProcess for Preview {
    fn start(&mut self, domain: &str, camera: &Path, cell: &Cell) -> anyhow::Result<()> {
        let config = PreviewConfig::new(domain, camera.to_owned(), *cell);
        let path = self.folder.path().join("preview.toml");
        let text = toml::to_string(&config).context("configuration of preview")?;
        files::write_atomic(&path, text.as_bytes())?;
        let spec = ProcessSpec {
            name: "preview",
            config: path,
            holds_arm: false,
        };
        self.process.start(&spec, self.folder.path())
    }

    fn check(&mut self) -> anyhow::Result<()> {
        self.process.check()
    }

    fn stop(&mut self) {
        self.process.stop();
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
    let process = args.preview.then(Preview::new).transpose().or_failed()?;
    let preview = process.map(|p| PreviewChild::new(Box::new(p), args.camera.clone()));
    let (mut watcher, url) = Watcher::start(wanted, args.bind, here, preview).map_err(|error| {
        match error.downcast_ref::<IpcError>() {
            Some(IpcError::Domain { .. }) => Failure::input(error),
            _ => Failure::of_server(error),
        }
    })?;
    // Whatever happens here may wait; what is watched may not.
    let _ = rustix::process::nice(NICE);
    let began = Instant::now();
    output::object(&json!({ "ok": true, "command": "watch", "url": url }));
    println!("{url}\nOpen it in a browser; Ctrl-C ends it.");
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
