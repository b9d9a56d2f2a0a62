//! The rope's keypoints for a page that is looked at, as the frames come.

use anyhow::Context;
use camera_ingest::preview::PreviewConfig;
use run_log::files;
use session::{ProcessSpec, Supervisor};
use std::path::Path;
use std::time::{Duration, Instant};
use viewer::live::Watcher;

/// Time between two attempts to start it.
const PAUSE: Duration = Duration::from_secs(2);

/// `wag process preview` as a child: it runs while there is something to look at and at no
/// other time, and what happens to it happens to nobody else.
#[derive(Debug)]
pub struct Preview {
    process: Supervisor,
    /// Its configuration and log.
    folder: tempfile::TempDir,
    view: Option<PreviewConfig>,
    /// When it was started last.
    begun: Option<Instant>,
    runs: bool,
}

impl Preview {
    /// One that looks at nothing yet.
    ///
    /// # Errors
    /// Its folder cannot be made.
    pub fn new() -> anyhow::Result<Self> {
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
    pub fn keep(&mut self, watcher: &mut Watcher, named: Option<&Path>) {
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
