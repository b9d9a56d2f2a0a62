//! What films a rope: its pictures, the camera, and how the clamp moved meanwhile.

use crate::cli::SceneArgs;
use crate::config;
use anyhow::{anyhow, bail, ensure};
use camera_ingest::source::{AnySource, BothImages, run_file};
use camera_ingest::{load_camera, open_video};
use cli_output::{OrInput, Outcome};
use run_log::files;
use run_log::{ClampMotion, Run};
use shared_types::StereoCamera;
use shared_types::file_error::why;
use std::path::{Path, PathBuf};

const NO_MOTION: &str = "name the clamp's motion with --joints or --pose";

/// The clamp's motion that the command line names.
pub fn named_motion(scene: &SceneArgs) -> anyhow::Result<ClampMotion> {
    let (path, joints) = match (&scene.motion.joints, &scene.motion.pose) {
        (Some(path), _) => (path, Some(files::read_joints(path)?)),
        (None, Some(path)) => (path, None),
        (None, None) => return Err(anyhow!(NO_MOTION)),
    };
    let late_s = scene.film_late_ms * 1e-3;
    Ok(ClampMotion::new(path, joints, config::cell()?.pole, late_s))
}

#[derive(Debug)]
pub struct FilmInput {
    source: AnySource,
    /// Where it is from.
    pub path: PathBuf,
    pub camera: StereoCamera,
    pub motion: ClampMotion,
    /// What is missing or damaged.
    pub warnings: Vec<String>,
}

/// The run's file, if `video` is one or a run's folder; it may be damaged, or not there.
fn run_of(video: &Path) -> Option<PathBuf> {
    if video.is_dir() {
        let file = video.join(files::RUN);
        let run = [files::RUN, files::CYCLES, files::COMMAND].map(|name| video.join(name));
        let is_run = run.iter().any(|path| path.try_exists().unwrap_or(true));
        return (is_run && !video.join("video.avi").exists()).then_some(file);
    }
    let named = video.extension().is_some_and(|e| e == "mcap");
    named.then(|| video.to_owned()).or_else(|| run_file(video))
}

impl FilmInput {
    /// Opens a recording given with the frame rate it does not tell. A run's file tells
    /// camera and motion itself; what the command line names goes first.
    pub fn open(video: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> Outcome<Self> {
        // Named alone it is meant for a run: say so if it is not there.
        if scene.camera.is_none() && !scene.motion.is_given() {
            std::fs::metadata(video)
                .map_err(|e| anyhow!("cannot read `{}`: {}", video.display(), why(&e)))
                .or_input()?;
        }
        match run_of(video) {
            Some(path) => Self::of_run(&path, rate_hz, scene).or_input(),
            None => Self::of_video(video, rate_hz, scene).or_input(),
        }
    }

    fn of_video(video: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> anyhow::Result<Self> {
        ensure!(
            scene.part.is_none(),
            "--part chooses a motion of a run's file, but `{}` is not such a file",
            video.display()
        );
        // Before anything is read: what is missing on the command line.
        ensure!(scene.motion.is_given(), NO_MOTION);
        Ok(Self {
            camera: scene.camera()?,
            motion: named_motion(scene)?,
            source: AnySource::Both(open_video(video, rate_hz)?),
            path: video.to_owned(),
            warnings: Vec::new(),
        })
    }

    fn of_run(path: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> anyhow::Result<Self> {
        let name = path.display();
        ensure!(
            rate_hz.is_none(),
            "--fps is for recordings without times, but the run's file `{name}` has them"
        );
        let run = Run::open(path)?;
        let part = run.film()?.part(scene.part.unwrap_or(1))?;
        let camera = match (&scene.camera, &part.camera) {
            (Some(file), _) => load_camera(file)?,
            (None, Some(Ok(camera))) => camera.clone(),
            (None, Some(Err(reason))) => bail!(
                "the camera in the run's file `{name}` cannot be used: {reason}; name another with --camera"
            ),
            (None, None) => {
                bail!("the run's file `{name}` does not tell its camera: name it with --camera")
            }
        };
        let motion = if scene.motion.is_given() {
            named_motion(scene)?
        } else {
            let joints = Some(part.joints.clone());
            ClampMotion::new(
                path,
                joints,
                config::cell_of(&run)?.pole,
                scene.film_late_ms * 1e-3,
            )
        };
        Ok(Self {
            warnings: part.warnings.clone(),
            source: AnySource::Left(Box::new(part)),
            path: path.to_owned(),
            camera,
            motion,
        })
    }

    /// Tells a person what is missing or damaged.
    pub fn warn(&self) {
        for warning in &self.warnings {
            eprintln!("warning: {warning}");
        }
    }

    /// Its frames, in memory.
    pub fn frames(&mut self) -> Outcome<BothImages> {
        self.source.read().or_input()
    }
}

impl SceneArgs {
    /// The camera that is named.
    pub fn camera(&self) -> anyhow::Result<StereoCamera> {
        let file = self.camera.as_ref();
        let file = file.ok_or_else(|| {
            anyhow!("name the camera's calibration and extrinsics (camera.toml) with --camera")
        })?;
        Ok(load_camera(file)?)
    }
}
