//! What films a rope: its pictures, the camera, and how the clamp moved meanwhile.

use crate::cli::SceneArgs;
use crate::config;
use anyhow::{Context, anyhow, bail, ensure};
use arm_model::{Cell, Pole};
use camera_ingest::source::{AnySource, BothImages, run_file};
use camera_ingest::{load_camera, open_video};
use cli_output::{OrInput, Outcome};
use rope_sim::{AttachMotion, MeasuredArm, PoseTrack};
use run_log::Run;
use run_log::files::{self, JointsCsv};
use shared_types::StereoCamera;
use std::path::{Path, PathBuf};

/// So much of a film may lie before or after what is told of the motion (s): the arm stands when
/// a recording begins and ends.
const UNTOLD_S: f64 = 0.5;
const NO_MOTION: &str = "name the clamp's motion with --joints or --pose";

/// How the clamp moved, on the film's clock: t = 0 is the first frame.
#[derive(Debug)]
pub struct ClampMotion {
    /// The file that tells it.
    path: PathBuf,
    /// Measured joints in it; else it has the attach frame's poses.
    joints: Option<JointsCsv>,
    pole: Pole,
    /// How late the film's times are on the motion's (s).
    late_s: f64,
}

impl ClampMotion {
    fn new(path: &Path, joints: Option<JointsCsv>, cell: Cell, scene: &SceneArgs) -> Self {
        Self {
            path: path.to_owned(),
            joints,
            pole: cell.pole,
            late_s: scene.film_late_ms * 1e-3,
        }
    }

    /// What the command line names.
    pub fn read(scene: &SceneArgs) -> anyhow::Result<Self> {
        let (path, joints) = match (&scene.motion.joints, &scene.motion.pose) {
            (Some(path), _) => (path, Some(files::read_joints(path)?)),
            (None, Some(path)) => (path, None),
            (None, None) => return Err(anyhow!(NO_MOTION)),
        };
        Ok(Self::new(path, joints, config::cell()?, scene))
    }

    /// The pole that carries the clamp, where its motion is that of joints.
    pub fn pole(&self) -> Option<&Pole> {
        self.joints.as_ref().map(|_| &self.pole)
    }

    /// Refuses a motion that tells of a part of the film only; before and after it the clamp
    /// would be taken to stand still.
    pub fn check_covers(&self, film_s: f64) -> anyhow::Result<()> {
        let times_s: Vec<f64> = match &self.joints {
            Some(csv) => csv.times_s.clone(),
            None => files::read_pose(&self.path)?
                .iter()
                .map(|row| row.t_s)
                .collect(),
        };
        let [first_s, last_s] = [times_s.first(), times_s.last()]
            .map(|t_s| t_s.map_or(f64::NAN, |t_s| t_s + self.late_s));
        ensure!(
            first_s <= UNTOLD_S && last_s >= film_s - UNTOLD_S,
            "`{}` tells the clamp's motion from {first_s:.2} to {last_s:.2} s, but the film lasts from 0 to {film_s:.2} s: record the motion for all of the film, or give its time with --film-late-ms",
            self.path.display()
        );
        Ok(())
    }

    /// For tracker and simulator.
    pub fn attach(&self) -> anyhow::Result<Box<dyn AttachMotion>> {
        let file = || format!("`{}`", self.path.display());
        if let Some(csv) = &self.joints {
            let times_s: Vec<f64> = csv.times_s.iter().map(|t| t + self.late_s).collect();
            let arm = MeasuredArm::new(&times_s, &csv.q, self.pole).with_context(file)?;
            return Ok(Box::new(arm));
        }
        let mut rows = files::read_pose(&self.path)?;
        for row in &mut rows {
            row.t_s += self.late_s;
        }
        Ok(Box::new(PoseTrack::new(&rows).with_context(file)?))
    }
}

#[derive(Debug)]
pub struct Filmed {
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

impl Filmed {
    /// Opens a recording given with the frame rate it does not tell. A run's file tells
    /// camera and motion itself; what the command line names goes first.
    pub fn open(video: &Path, rate_hz: Option<f64>, scene: &SceneArgs) -> Outcome<Self> {
        // Named alone it is meant for a run: say so if it is not there.
        if scene.camera.is_none() && !scene.motion.is_given() {
            std::fs::metadata(video)
                .with_context(|| {
                    let name = video.display();
                    format!("cannot read `{name}`; check the path and its permissions")
                })
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
            "--part chooses a motion of a run's file, but `{}` is none",
            video.display()
        );
        // Before anything is read: what is missing on the command line.
        ensure!(scene.motion.is_given(), NO_MOTION);
        Ok(Self {
            camera: scene.camera()?,
            motion: ClampMotion::read(scene)?,
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
                "the camera in the run's file `{name}` is none: {reason}; name another with --camera"
            ),
            (None, None) => {
                bail!("the run's file `{name}` does not tell its camera: name it with --camera")
            }
        };
        let motion = if scene.motion.is_given() {
            ClampMotion::read(scene)?
        } else {
            let joints = Some(part.joints.clone());
            ClampMotion::new(path, joints, config::cell_of(&run)?, scene)
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
            anyhow!("name the camera's calibration and place (camera.toml) with --camera")
        })?;
        Ok(load_camera(file)?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Poses from one time to another.
    fn poses(folder: &Path, from_s: f64, to_s: f64) -> ClampMotion {
        let mut text = "t,x,y,z,qw,qx,qy,qz\n".to_owned();
        for i in 0..=100 {
            let t_s = from_s + (to_s - from_s) * f64::from(i) / 100.0;
            text.push_str(&format!("{t_s},0,0,1,1,0,0,0\n"));
        }
        let path = folder.join("pose.csv");
        std::fs::write(&path, text).unwrap();
        ClampMotion {
            path,
            joints: None,
            pole: Pole::default(),
            late_s: 0.0,
        }
    }

    #[test]
    fn a_motion_told_for_a_part_of_the_film_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let check = |from_s, to_s| poses(folder.path(), from_s, to_s).check_covers(6.7);
        assert!(check(0.0, 6.7).is_ok() && check(-1.0, 8.0).is_ok() && check(0.3, 6.4).is_ok());
        for (from_s, to_s) in [(0.0, 0.2), (6.5, 6.7), (1.0, 8.0)] {
            let refusal = check(from_s, to_s).unwrap_err().to_string();
            assert!(
                refusal.contains("pose.csv") && refusal.contains("6.70 s"),
                "{refusal}"
            );
        }
    }
}
