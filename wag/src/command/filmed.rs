//! What films a rope: its pictures, the camera, and how the clamp moved meanwhile.

use crate::cli::{MotionArgs, SceneArgs};
use crate::failure::{OrInput, Outcome};
use crate::files::{self, JointsCsv};
use crate::mcap_file::RunFilm;
use anyhow::{Context, anyhow, ensure};
use camera_ingest::source::{read_left, run_file};
use camera_ingest::{ClampPath, EyeFrame, FrameSource, load_camera, open_video};
use rope_sim::{AttachMotion, MeasuredArm, PoseTrack};
use shared_types::StereoCamera;
use std::path::{Path, PathBuf};

const NO_MOTION: &str = "name the clamp's motion with --joints or --pose";

/// How the clamp moved; t = 0 is the first frame.
#[derive(Debug)]
pub enum ClampMotion {
    /// Measured joints, and the file that tells them.
    Joints(PathBuf, JointsCsv),
    /// The file of the attach frame's poses.
    Pose(PathBuf),
}

impl ClampMotion {
    /// What the command line names.
    pub fn read(motion: &MotionArgs) -> anyhow::Result<Self> {
        match (&motion.joints, &motion.pose) {
            (Some(path), _) => Ok(Self::Joints(path.clone(), files::read_joints(path)?)),
            (None, Some(path)) => Ok(Self::Pose(path.clone())),
            (None, None) => Err(anyhow!(NO_MOTION)),
        }
    }

    /// For the tracker.
    pub fn clamp_path(&self) -> anyhow::Result<ClampPath> {
        match self {
            Self::Joints(path, csv) => {
                let samples: Vec<_> = csv.times_s.iter().copied().zip(csv.q.clone()).collect();
                ClampPath::from_joints(&samples).with_context(|| format!("`{}`", path.display()))
            }
            Self::Pose(path) => Ok(ClampPath::from_pose_csv(path)?),
        }
    }

    /// For the simulator.
    pub fn attach(&self) -> anyhow::Result<Box<dyn AttachMotion>> {
        match self {
            Self::Joints(path, csv) => {
                let arm = MeasuredArm::new(&csv.times_s, &csv.q)
                    .with_context(|| format!("`{}`", path.display()))?;
                Ok(Box::new(arm))
            }
            Self::Pose(path) => {
                let track = PoseTrack::new(&files::read_pose(path)?)
                    .with_context(|| format!("`{}`", path.display()))?;
                Ok(Box::new(track))
            }
        }
    }
}

/// A film of a rope.
#[derive(Debug)]
pub struct Filmed {
    source: Box<dyn FrameSource>,
    /// Where it is from.
    pub path: PathBuf,
    /// What filmed it.
    pub camera: StereoCamera,
    /// The clamp's motion.
    pub motion: ClampMotion,
}

impl Filmed {
    /// Opens a recording given with the frame rate it does not tell. A run's file tells
    /// camera and motion itself; what the command line names goes first.
    pub fn open(video: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> Outcome<Self> {
        if let Some(path) = run_file(video) {
            return Self::of_run(&path, rate_hz, scene).or_input();
        }
        Self::of_video(video, rate_hz, scene).or_input()
    }

    fn of_video(video: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> anyhow::Result<Self> {
        ensure!(
            scene.part.is_none(),
            "--part chooses a motion of a run's file, but `{}` is none",
            video.display()
        );
        // Before anything is read: what is missing on the command line.
        ensure!(scene.motion.is_given(), NO_MOTION);
        Ok(Self {
            camera: scene.camera()?,
            motion: ClampMotion::read(&scene.motion)?,
            source: Box::new(open_video(video, rate_hz)?),
            path: video.to_owned(),
        })
    }

    fn of_run(path: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> anyhow::Result<Self> {
        ensure!(
            rate_hz.is_none(),
            "--fps is for recordings without times, but the run's file `{}` has them",
            path.display()
        );
        let part = RunFilm::read(path)?.part(scene.part.unwrap_or(1))?;
        let camera = match (&scene.camera, &part.camera) {
            (Some(file), _) => load_camera(file)?,
            (None, Some(camera)) => camera.clone(),
            (None, None) => {
                return Err(anyhow!(
                    "the run's file `{}` does not tell its camera: name it with --camera",
                    path.display()
                ));
            }
        };
        let motion = if scene.motion.is_given() {
            ClampMotion::read(&scene.motion)?
        } else {
            ClampMotion::Joints(path.to_owned(), part.joints.clone())
        };
        Ok(Self {
            source: Box::new(part),
            path: path.to_owned(),
            camera,
            motion,
        })
    }

    /// Its frames, in memory.
    pub fn frames(&mut self) -> Outcome<Vec<EyeFrame>> {
        read_left(&mut *self.source).or_input()
    }
}

impl SceneArgs {
    /// The camera that is named.
    pub fn camera(&self) -> anyhow::Result<StereoCamera> {
        let file = self.camera.as_ref();
        let file = file.ok_or_else(|| {
            anyhow!("name the camera's calibration and place (camera.toml) with --camera")
        })?;
        Ok(load_camera(file)?)
    }
}
