//! What the folder of a running run tells: its rope once it is identified, the target,
//! where the camera stands.

use super::stage::Results;
use anyhow::Context;
use arm_model::Cell;
use camera_ingest::load_camera;
use rt_controller::ControllerConfig;
use run_log::files;
use shared_types::{Plan, RopeParams, StereoCamera};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Files that are looked at, in the order of [`Facts::stamps`].
const FILES: [&str; 4] = [files::ROPE, files::PLAN, files::CAMERA, files::CELL];

/// The domain that a run's controller was configured with.
pub fn domain_of_run(run: &Path) -> anyhow::Result<String> {
    let path = run.join("config").join("rt-controller.toml");
    let text = files::read_text(&path)
        .with_context(|| format!("`{}` is not a run folder with a controller", run.display()))?;
    let config: ControllerConfig =
        toml::from_str(&text).with_context(|| format!("`{}`", path.display()))?;
    Ok(config.domain)
}

/// Facts of one run folder, read again when a file changes.
#[derive(Debug, Default)]
pub struct Facts {
    /// The folder, where there is one.
    pub folder: Option<PathBuf>,
    stamps: [Option<SystemTime>; 4],
    identified: Option<RopeParams>,
    plan: Option<Plan>,
    /// The camera, where its calibration lies in the folder.
    pub camera: Option<StereoCamera>,
    /// The cell it runs in, where the folder tells it.
    pub cell: Option<Cell>,
}

impl Facts {
    pub(crate) fn of(folder: Option<PathBuf>) -> Self {
        let mut facts = Self {
            folder,
            ..Self::default()
        };
        facts.look();
        facts
    }

    /// The file of the camera's calibration, where it lies in the folder.
    pub(crate) fn camera_file(&self) -> Option<PathBuf> {
        self.camera.as_ref()?;
        Some(self.folder.as_ref()?.join(files::CAMERA))
    }

    /// Reads what has changed. Files are written whole or not at all; one that is there
    /// and wrong counts as not there.
    pub(crate) fn look(&mut self) {
        let Some(folder) = &self.folder else { return };
        for (file, stamp) in FILES.iter().zip(&mut self.stamps) {
            let path = folder.join(file);
            let now = path.metadata().and_then(|m| m.modified()).ok();
            if now == *stamp {
                continue;
            }
            *stamp = now;
            match *file {
                files::ROPE => self.identified = files::read_rope(&path).ok(),
                files::PLAN => self.plan = files::read_json(&path).ok(),
                files::CELL => self.cell = files::read_cell(&path).ok(),
                _ => self.camera = load_camera(&path).ok(),
            }
        }
    }

    /// What lies in the folder; none without one.
    pub(crate) fn results(&self) -> Option<Results> {
        Some(Results {
            keypoints: self.folder.as_ref()?.join(files::KEYPOINTS).is_file(),
            rope: self.identified.is_some(),
            plan: self.plan.is_some(),
        })
    }

    /// The rope, and what it is called.
    pub(crate) fn rope(&self) -> Option<(RopeParams, &'static str)> {
        let planned = || Some((self.plan.as_ref()?.rope, "the plan's rope, simulated"));
        self.identified
            .map(|rope| (rope, "the identified rope, simulated"))
            .or_else(planned)
    }

    /// Where the throw is to go (m).
    pub fn target_m(&self) -> Option<[f64; 3]> {
        self.plan.as_ref().map(|plan| plan.target_m)
    }
}

/// The run folder of a controller that a command of `wag` started: its configuration
/// lies in there. A daemon's lies elsewhere, and it has none.
pub(crate) fn folder_of_process(pid: u32) -> Option<PathBuf> {
    let process = PathBuf::from(format!("/proc/{pid}"));
    let line = std::fs::read(process.join("cmdline")).ok()?;
    let mut words = line.split(|byte| *byte == 0);
    words.by_ref().find(|word| *word == b"--config")?;
    let config = PathBuf::from(String::from_utf8(words.next()?.to_vec()).ok()?);
    let config = process.join("cwd").read_link().ok()?.join(config);
    let folder = config.parent()?;
    (folder.file_name()? == "config").then(|| folder.parent().map(Path::to_owned))?
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::rope::RANGES;

    #[test]
    fn files_count_as_soon_as_they_are_there() {
        let dir = tempfile::tempdir().unwrap();
        let mut facts = Facts::of(Some(dir.path().to_owned()));
        assert!(facts.rope().is_none() && facts.target_m().is_none());
        let rope = RopeParams::from_array(RANGES.map(|r| r.min));
        let text = toml::to_string(&rope).unwrap();
        std::fs::write(dir.path().join(files::ROPE), text).unwrap();
        std::fs::write(dir.path().join(files::PLAN), "{").unwrap();
        facts.look();
        assert_eq!(facts.rope().unwrap().0, rope);
        assert!(facts.target_m().is_none());
        let results = facts.results().unwrap();
        assert_eq!((results.rope, results.plan), (true, false));
        assert_eq!(Facts::default().results(), None);
    }

    #[test]
    fn a_process_without_a_configuration_has_no_folder() {
        assert_eq!(folder_of_process(std::process::id()), None);
        assert_eq!(folder_of_process(u32::MAX), None);
    }
}
