//! The preview as a child of the page: it runs while somebody watches and at no other
//! time, and what happens to it happens to nobody else.

use arm_model::Cell;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time between two attempts to start it.
const PAUSE: Duration = Duration::from_secs(2);

/// How the preview's process is started and ended.
pub trait PreviewProcess: Debug {
    /// Starts it on the camera of a shared-memory domain, in the cell it looks at.
    ///
    /// # Errors
    /// It cannot be started.
    fn start(&mut self, domain: &str, camera: &Path, cell: &Cell) -> anyhow::Result<()>;
    /// Looks after it.
    ///
    /// # Errors
    /// It ended on its own.
    fn check(&mut self) -> anyhow::Result<()>;
    /// Ends it, if it runs.
    fn stop(&mut self);
}

/// What it is to look at.
#[derive(Debug, Clone, PartialEq)]
struct View {
    domain: String,
    camera: PathBuf,
    cell: Cell,
}

/// The process, while there is something to look at.
#[derive(Debug)]
pub struct PreviewChild {
    process: Box<dyn PreviewProcess>,
    view: Option<View>,
    /// When it was started last.
    begun: Option<Instant>,
    runs: bool,
    /// The calibration named on the command line.
    camera: Option<PathBuf>,
}

impl PreviewChild {
    /// None runs yet. `camera` goes before the calibration in a run folder.
    #[must_use]
    pub fn new(process: Box<dyn PreviewProcess>, camera: Option<PathBuf>) -> Self {
        Self {
            process,
            view: None,
            begun: None,
            runs: false,
            camera,
        }
    }

    /// Lets it look at this domain through this calibration, in this cell; call it now and
    /// then. One that ended is started again, unless `another` is there.
    pub(crate) fn keep(
        &mut self,
        domain: Option<&str>,
        camera: Option<&Path>,
        cell: &Cell,
        another: bool,
    ) {
        let camera = self.camera.as_deref().or(camera);
        let wanted = domain.zip(camera).map(|(domain, camera)| View {
            domain: domain.to_owned(),
            camera: camera.to_owned(),
            cell: *cell,
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
        match self.process.start(&view.domain, &view.camera, &view.cell) {
            Ok(()) => self.runs = true,
            Err(reason) => tracing::warn!("there is no preview: {reason:#}"),
        }
    }

    /// Whether no calibration is known for what is watched.
    pub(crate) fn lacks_camera(&self) -> bool {
        self.view.is_none()
    }
}
