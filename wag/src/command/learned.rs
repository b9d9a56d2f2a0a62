//! Learned models in the place of the tracker's parts.

use crate::cli::ModelArgs;
use anyhow::anyhow;
use camera_ingest::TrackError;
use camera_ingest::calib::load_model_files;
use camera_ingest::learned::{OnnxSegmenter, OnnxTracker};
use camera_ingest::track::{ModelError, Models};
use cli_output::{Failure, OrInput, Outcome};
use serde_json::{Value, json};
use shared_types::StereoCamera;
use std::path::{Path, PathBuf};

/// The models that are used; what there is none for is built in.
#[derive(Debug)]
pub struct Learned {
    segmenter: Option<(PathBuf, OnnxSegmenter)>,
    tracker: Option<(PathBuf, OnnxTracker)>,
    lead_px: Option<[f64; 2]>,
}

/// Bad input where it is the file's fault.
fn refused(error: ModelError) -> Failure {
    match error {
        ModelError::Runtime { .. } => Failure::failed(error),
        ModelError::Unreadable { .. }
        | ModelError::Refused { .. }
        | ModelError::Names { .. }
        | ModelError::Form { .. }
        | ModelError::Count { .. }
        | ModelError::NotFinite { .. } => Failure::input(error),
    }
}

fn load<T>(
    path: Option<PathBuf>,
    load: impl Fn(&Path) -> Result<T, ModelError>,
) -> Outcome<Option<(PathBuf, T)>> {
    let Some(path) = path else { return Ok(None) };
    let model = load(&path).map_err(refused)?;
    Ok(Some((path, model)))
}

/// Which file does a part's work, if not this program itself.
fn who(model: Option<(&Path, &str)>) -> Value {
    model.map_or_else(
        || json!({ "by": "built-in" }),
        |(path, sha256)| json!({ "by": "model", "file": path, "sha256": sha256 }),
    )
}

/// A prompt nobody reads, or beside the picture, is a mistake.
fn check_lead(lead_px: Option<[f64; 2]>, read: bool, camera: &StereoCamera) -> Outcome {
    let Some([u, v]) = lead_px else { return Ok(()) };
    if !read {
        return Err(Failure::input(anyhow!(
            "--lead-px is a prompt for a segmenter: name one with --segmenter"
        )));
    }
    if !camera.contains([u, v]) {
        return Err(Failure::input(anyhow!(
            "--lead-px {u},{v} lies outside the left image's {}x{} px",
            camera.width_px,
            camera.height_px
        )));
    }
    Ok(())
}

impl Learned {
    /// The models that the command line names, or else `camera.toml`; `camera` is what
    /// that file says.
    ///
    /// # Errors
    /// Why a file is refused.
    pub fn load(
        args: Option<&ModelArgs>,
        file: Option<&Path>,
        camera: &StereoCamera,
    ) -> Outcome<Self> {
        let files = file.map(load_model_files).transpose().or_input()?;
        let files = files.unwrap_or_default();
        let named = |pick: fn(&ModelArgs) -> &Option<PathBuf>| args.and_then(|a| pick(a).clone());
        let segmenter = named(|a| &a.segmenter).or(files.segmenter);
        let tracker = named(|a| &a.tracker).or(files.tracker);
        let lead_px = args.and_then(|a| a.lead_px).map(|pixel| pixel.0);
        check_lead(lead_px, segmenter.is_some(), camera)?;
        Ok(Self {
            segmenter: load(segmenter, OnnxSegmenter::load)?,
            tracker: load(tracker, OnnxTracker::load)?,
            lead_px,
        })
    }

    /// What the tracker takes.
    pub fn models(&mut self) -> Models<'_> {
        Models {
            first_mask: self.segmenter.as_mut().map(|(_, model)| model as _),
            point_tracker: self.tracker.as_mut().map(|(_, model)| model as _),
        }
    }

    /// Where the lead's centre is, if somebody said.
    pub fn lead_px(&self) -> Option<[f64; 2]> {
        self.lead_px
    }

    /// Who did what, for machines.
    pub fn report(&self) -> Value {
        let segmenter = self.segmenter.as_ref();
        let tracker = self.tracker.as_ref();
        json!({
            "first_mask": who(segmenter.map(|(path, m)| (path.as_path(), m.sha256()))),
            "following": who(tracker.map(|(path, m)| (path.as_path(), m.sha256()))),
        })
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
