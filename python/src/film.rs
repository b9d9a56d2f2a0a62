//! From a film to keypoints, from keypoints to a rope.

use crate::error::{OrRaise, interruptible, raised};
use crate::motion::{Motion, cell_of};
use crate::threads::THREADS_MAX;
use anyhow::{Context, anyhow};
use camera_ingest::source::read_film;
use camera_ingest::{load_camera, open_video};
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3, PyReadonlyArray1};
use planner::PlannerConfig;
use planner::identify::{IdentifyOptions, Method, fitted_keypoints};
use planner::observation::{Appearance, Observation, ObservedPoints};
use pyo3::prelude::*;
use rope_sim::AttachMotion;
use run_log::{ClampMotion, Run, files};
use serde_json::json;
use shared_types::{KeypointTrack, RopeEstimate, StereoCamera};
use std::path::PathBuf;

/// Tracks the rope through a film: keypoints, and what the rope looks like, as JSON.
#[pyfunction]
#[pyo3(signature = (video, camera, motion, keypoints, rate_hz = None))]
pub(crate) fn track(
    py: Python<'_>,
    video: PathBuf,
    camera: PathBuf,
    motion: Py<Motion>,
    keypoints: usize,
    rate_hz: Option<f64>,
) -> PyResult<String> {
    let camera = load_camera(&camera).or_input()?;
    let motion = motion.get();
    py.detach(|| {
        let mut source = open_video(&video, rate_hz).or_input()?;
        let images = read_film(&mut *source).or_input()?;
        if let (Some(first), Some(last)) = (images.left.first(), images.left.last()) {
            motion.check_covers((last.stamp_ns - first.stamp_ns) as f64 * 1e-9)?;
        }
        let found = camera_ingest::track(images.film(), &camera, motion.attach(), keypoints);
        let found = found.map_err(|error| {
            let is_input = error.is_input();
            let video = format!("video `{}`", video.display());
            raised(is_input, anyhow::Error::new(error).context(video))
        })?;
        Ok(json!({
            "track": found.track,
            "rope_radius_m": found.appearance.rope_radius_m,
            "lead_radius_m": found.appearance.lead_radius_m,
            "clamp": found.clamp.map(|c| json!({
                "time_offset_s": c.time_offset_s, "time_std_s": c.time_std_s,
                "aside_m": c.aside_m, "aside_std_m": c.aside_std_m,
            })),
        })
        .to_string())
    })
}

/// How a rope is identified.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct How {
    method: String,
    seed: u64,
    length_m: Option<f64>,
    lead_mass_kg: Option<f64>,
    threads: usize,
    /// The planner's configuration; none for the built-in one.
    config: Option<PathBuf>,
}

impl How {
    fn options(&self) -> PyResult<IdentifyOptions> {
        let config = config_of(self.config.as_deref())?;
        let named = serde_json::Value::from(self.method.as_str());
        let method = serde_json::from_value::<Method>(named).with_context(|| {
            format!(
                "`method` is `{}`, but must be hybrid, hybrid_search, cmaes or network",
                self.method
            )
        });
        Ok(IdentifyOptions {
            method: method.or_input()?,
            seed: self.seed,
            length_m: self.length_m,
            lead_mass_kg: self.lead_mass_kg,
            threads: self.threads.clamp(1, THREADS_MAX),
            ..config.identify
        })
    }
}

/// A planner's configuration file, or the built-in configuration.
pub(crate) fn config_of(path: Option<&std::path::Path>) -> PyResult<PlannerConfig> {
    path.map_or_else(
        || Ok(PlannerConfig::default()),
        |path| files::read_toml(path, "planner configuration").or_input(),
    )
}

/// Identifies the rope of keypoints (JSON); the estimate as JSON.
#[pyfunction]
#[pyo3(signature = (keypoints, camera, motion, radii_m, how))]
pub(crate) fn identify(
    py: Python<'_>,
    keypoints: &str,
    camera: PathBuf,
    motion: Py<Motion>,
    radii_m: [Option<f64>; 2],
    how: How,
) -> PyResult<String> {
    let track = serde_json::from_str::<KeypointTrack>(keypoints).context("keypoints");
    let track = track.or_input()?;
    track.validate().or_input()?;
    let camera = load_camera(&camera).or_input()?;
    let motion = motion.get();
    motion.check_covers(track.frames.last().map_or(0.0, |frame| frame.t_s))?;
    estimate(py, &track, (&camera, motion.attach(), radii_m), &how)
}

/// The same of a run's wiggle as it was tracked, with the run's own camera and cell: the
/// estimate, and why the track should not be relied on. Nothing is identified where that is so
/// and was not accepted.
#[pyfunction]
#[pyo3(signature = (run, how, accepted, cell = None))]
pub(crate) fn identify_run(
    py: Python<'_>,
    run: PathBuf,
    how: How,
    accepted: bool,
    cell: Option<PathBuf>,
) -> PyResult<(Option<String>, Vec<String>)> {
    let opened = Run::open(&run).or_input()?;
    let film = opened.tracked_film().or_input()?;
    let camera = load_camera(&opened.folder().join(files::CAMERA)).or_input()?;
    let kept = opened.cell().or_input()?.filter(|_| cell.is_none());
    let pole = kept.map_or_else(|| cell_of(cell.as_deref()), Ok)?.pole;
    let clamp = ClampMotion::new(&run, Some(film.joints), pole, 0.0);
    clamp
        .check_covers(film.track.frames.last().map_or(0.0, |frame| frame.t_s))
        .or_input()?;
    let motion = clamp.attach().or_input()?;
    let unconfirmed = film.track.unconfirmed.clone();
    if !(unconfirmed.is_empty() || accepted) {
        return Ok((None, unconfirmed));
    }
    let found = estimate(py, &film.track, (&camera, &*motion, film.radii_m), &how)?;
    Ok((Some(found), unconfirmed))
}

/// Pixels, (frames, keypoints, 2), at which an identified rope (JSON) is seen in frames that begin
/// at these times; not a number behind the camera.
#[pyfunction]
pub(crate) fn fitted_pixels<'py>(
    py: Python<'py>,
    estimate: &str,
    camera: PathBuf,
    motion: Py<Motion>,
    times_s: PyReadonlyArray1<'py, f64>,
    keypoints: usize,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    /// Longest film that is simulated (s).
    const FILM_MAX_S: f64 = 600.0;
    let estimate = serde_json::from_str::<RopeEstimate>(estimate).context("estimate");
    let estimate = estimate.or_input()?;
    let camera = load_camera(&camera).or_input()?;
    let times_s = times_s.as_array().to_vec();
    if let Some(t) = times_s.iter().find(|t| !(0.0..=FILM_MAX_S).contains(*t)) {
        let told = anyhow!("`t_s` has {t} in it, but a film's frames are 0 to {FILM_MAX_S} s");
        return Err(told).or_input();
    }
    let motion = motion.get();
    motion.check_covers(times_s.iter().copied().fold(0.0, f64::max))?;
    let seen = py
        .detach(|| fitted_keypoints(&estimate, &camera, motion.attach(), &times_s, keypoints))
        .or_input()?;
    let shape = (times_s.len(), keypoints, 2);
    let pixel = |(i, k, axis): (usize, usize, usize)| seen[i][k].map_or(f64::NAN, |p| p[axis]);
    Ok(Array3::from_shape_fn(shape, pixel).into_pyarray(py))
}

fn estimate(
    py: Python<'_>,
    track: &KeypointTrack,
    (camera, motion, radii_m): (&StereoCamera, &dyn AttachMotion, [Option<f64>; 2]),
    how: &How,
) -> PyResult<String> {
    let options = how.options()?;
    let [rope_radius_m, lead_radius_m] = radii_m;
    let observation = Observation {
        track,
        points: ObservedPoints::ArcLength,
        camera,
        motion,
        appearance: Appearance {
            rope_radius_m,
            lead_radius_m,
        },
    };
    interruptible(py, |progress| {
        let found = planner::identify(&observation, &options, None, progress);
        let found = found.map_err(|error| raised(error.is_input(), error))?;
        serde_json::to_string(&found).or_failed()
    })
}
