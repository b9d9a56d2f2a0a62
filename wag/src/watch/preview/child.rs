//! The preview as a child of the page: it runs while somebody watches and at no other
//! time, and what happens to it happens to nobody else.

use crate::pipeline::preview_spec;
use crate::session::Supervisor;
use anyhow::Context;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two attempts to start it.
const PAUSE: Duration = Duration::from_secs(2);

/// What it is to look at.
#[derive(Debug, Clone, PartialEq, Eq)]
struct View {
    domain: String,
    camera: PathBuf,
}

/// The process, while there is something to look at.
#[derive(Debug)]
pub struct PreviewChild {
    process: Supervisor,
    view: Option<View>,
    /// When it was started last.
    begun: Option<Instant>,
    runs: bool,
    /// Its configuration and log.
    folder: tempfile::TempDir,
    /// The calibration named on the command line.
    camera: Option<PathBuf>,
}

impl PreviewChild {
    /// None runs yet. `camera` goes before the calibration in a run folder.
    ///
    /// # Errors
    /// There is no room for its configuration.
    pub fn new(camera: Option<PathBuf>) -> anyhow::Result<Self> {
        let folder = tempfile::Builder::new().prefix("wag-preview-").tempdir();
        Ok(Self {
            process: Supervisor::default(),
            view: None,
            begun: None,
            runs: false,
            folder: folder.context("cannot make a folder for the preview's configuration")?,
            camera,
        })
    }

    /// Lets it look at this domain through this calibration; call it now and then. One
    /// that ended is started again, unless `another` is there.
    pub fn keep(&mut self, domain: Option<&str>, camera: Option<&Path>, another: bool) {
        let camera = self.camera.as_deref().or(camera);
        let wanted = domain.zip(camera).map(|(domain, camera)| View {
            domain: domain.to_owned(),
            camera: camera.to_owned(),
        });
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
        let Some(view) = &self.view else { return };
        if self.runs || another || early {
            return;
        }
        self.begun = Some(Instant::now());
        match start(&mut self.process, self.folder.path(), view) {
            Ok(()) => self.runs = true,
            Err(reason) => tracing::warn!("there is no preview: {reason:#}"),
        }
    }

    /// Whether no calibration is known for what is watched.
    pub fn lacks_camera(&self) -> bool {
        self.view.is_none()
    }
}

fn start(process: &mut Supervisor, folder: &Path, view: &View) -> anyhow::Result<()> {
    let spec = preview_spec(folder, &view.domain, &view.camera)?;
    process.start(&spec, folder)
}
