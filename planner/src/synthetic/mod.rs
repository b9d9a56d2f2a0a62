//! Films of known ropes: what a camera's tracker would give, made from the
//! simulator.
//!
//! [`record`] simulates many ropes in one batch and keeps the paths of their
//! keypoints in the world ([`RopeFilm`]); [`project`] looks at one of them through
//! a camera, with the errors a real recording has ([`FilmNoise`]). The two are
//! apart so that a network sees the same rope through fresh noise every time
//! without simulating it again. [`film`] does both for one rope.

mod camera;
mod noise;
mod project;
mod record;

pub use camera::side_camera;
pub use noise::{FilmNoise, Randomisation};
pub use project::{FilmTiming, SyntheticFilm, project};
pub use record::{KeypointLayout, RecordOptions, RopeFilm, record};

use rope_sim::{AttachMotion, SimulateError};
use shared_types::{RopeParams, StereoCamera};

/// Films one rope, simulated finely. A number of keypoints means so many, uniform in arc
/// length.
pub fn film(
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    camera: &StereoCamera,
    keypoints: impl Into<KeypointLayout>,
    timing: &FilmTiming,
    noise: &FilmNoise,
) -> Result<SyntheticFilm, SimulateError> {
    let options = RecordOptions {
        layout: keypoints.into(),
        duration_s: timing.duration_s() + noise.clock_offset_s.abs() + 0.05,
        ..RecordOptions::default()
    };
    let films = record(core::slice::from_ref(rope), motion, &options)?;
    // One rope in, one film out.
    Ok(project(&films[0], camera, timing, noise))
}

#[cfg(test)]
mod tests;
