//! A learned tracker of points in the place of the tracker's reading.

use crate::cli::ModelArgs;
use camera_ingest::TrackError;
use camera_ingest::calib::load_model_files;
use camera_ingest::learned::OnnxTracker;
use camera_ingest::track::ModelError;
use cli_output::{Failure, OrInput, Outcome};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The model that is used; without one, the film is read as it is built in.
#[derive(Debug)]
pub struct Learned {
    tracker: Option<(PathBuf, OnnxTracker)>,
}

/// Bad input where it is the file's fault.
fn refused(error: ModelError) -> Failure {
    Failure::of(!matches!(error, ModelError::Runtime { .. }), error)
}

impl Learned {
    /// The model that the command line names, or else `camera.toml`.
    pub fn load(args: Option<&ModelArgs>, file: Option<&Path>) -> Outcome<Self> {
        let files = file.map(load_model_files).transpose().or_input()?;
        let tracker = args.and_then(|a| a.tracker.clone());
        let path = tracker.or(files.unwrap_or_default().tracker);
        let load = |path: PathBuf| OnnxTracker::load(&path).map(|model| (path, model));
        Ok(Self {
            tracker: path.map(load).transpose().map_err(refused)?,
        })
    }

    pub fn tracker(&mut self) -> Option<&mut OnnxTracker> {
        self.tracker.as_mut().map(|(_, model)| model)
    }

    /// Who read the film, for machines.
    pub fn report(&self) -> Value {
        let by = self.tracker.as_ref().map_or_else(
            || json!({ "by": "built-in" }),
            |(path, model)| json!({ "by": "model", "file": path, "sha256": model.sha256() }),
        );
        json!({ "reading": by })
    }
}

/// What cannot be tracked as it was given is bad input; a rope that was looked for and not
/// found is not.
pub fn classify(error: TrackError, video: &Path) -> Failure {
    match error {
        TrackError::Model(error) => refused(error),
        error => {
            let video = format!("video `{}`", video.display());
            Failure::of(error.is_input(), anyhow::Error::new(error).context(video))
        }
    }
}
