//! `wag watch`: a page in the browser that shows what runs.

use crate::cli::WatchArgs;
use crate::config;
use anyhow::Context;
use camera_ingest::load_camera;
use camera_ingest::preview::PreviewConfig;
use cli_output::{Failure, OrInput, Outcome, is_interrupted, output, watch_interrupts};
use run_log::files;
use serde_json::{Value, json};
use session::{ProcessSpec, Supervisor};
use shared_types::ipc::IpcError;
use std::path::Path;
use std::time::{Duration, Instant};
use viewer::live::{Wanted, Watcher, domain_of_run};

/// How much sooner everything else gets a processor than this program.
const NICE: i32 = 10;

/// Time between two attempts to start it.
const PAUSE: Duration = Duration::from_secs(2);

/// `wag process preview` as a child: it runs while there is something to look at and at no
/// other time, and what happens to it happens to nobody else.
#[derive(Debug)]
struct Preview {
    process: Supervisor,
    /// Its configuration and log.
    folder: tempfile::TempDir,
    view: Option<PreviewConfig>,
    /// When it was started last.
    begun: Option<Instant>,
    runs: bool,
}

impl Preview {
    fn new() -> anyhow::Result<Self> {
        let folder = tempfile::Builder::new().prefix("wag-preview-").tempdir();
        Ok(Self {
            process: Supervisor::default(),
            folder: folder.context("cannot make a folder for the preview's configuration")?,
            view: None,
            begun: None,
            runs: false,
        })
    }

    /// Lets it look at what is watched, through the calibration `named` or else that of the
    /// run; call it now and then. One that ended is started again, unless another is there.
    fn keep(&mut self, watcher: &mut Watcher, named: Option<&Path>) {
        let wanted = watcher.preview_view(named);
        if wanted != self.view {
            self.process.stop();
            (self.view, self.begun, self.runs) = (wanted, None, false);
        }
        if let Err(reason) = self.process.check() {
            tracing::warn!("the preview ended: {reason:#}");
            self.process.stop();
            self.runs = false;
        }
        let early = self.begun.is_some_and(|at| at.elapsed() < PAUSE);
        if self.runs || early || watcher.has_preview() {
            return;
        }
        if let Some(view) = self.view.clone() {
            self.begun = Some(Instant::now());
            match self.start(&view) {
                Ok(()) => self.runs = true,
                Err(reason) => tracing::warn!("there is no preview: {reason:#}"),
            }
        }
    }

    fn start(&mut self, view: &PreviewConfig) -> anyhow::Result<()> {
        let path = self.folder.path().join("preview.toml");
        let text = toml::to_string(view).context("configuration of preview")?;
        files::write_atomic(&path, text.as_bytes())?;
        let spec = ProcessSpec {
            name: "preview",
            config: path,
            holds_arm: false,
        };
        self.process.start(&spec, self.folder.path())
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
    let mut preview = args.preview.then(Preview::new).transpose().or_failed()?;
    let (mut watcher, url) =
        Watcher::start(wanted, args.bind, here).map_err(|error| {
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
    while !is_interrupted() && !over() {
        let searched = watcher.turn().or_failed()?;
        // What is joined anew in the next turn is still what the preview looks at.
        if let Some(preview) = preview.as_mut().filter(|_| searched) {
            preview.keep(&mut watcher, args.camera.as_deref());
        }
    }
    Ok(None)
}
