//! One rope, however it was found, beside a film.

use super::coarse::{Comparer, INVISIBLE_PX};
use super::coordinates::{CLOCK, Coordinates, Reach, point_of};
use super::film::Film;
use super::{CorrectionPrior, check, clock_window};
use super::{IdentifyError, IdentifyOptions, Observation};
use shared_types::RopeParams;

/// How well a rope fits a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Compared {
    /// Root mean square (Huber) distance between seen and simulated keypoints, the
    /// camera's small misplacement taken out (px).
    pub distance_px: f64,
    /// Camera time minus motion time (s).
    pub time_offset_s: f64,
}

/// Simulates one rope and compares it with a film.
///
/// # Errors
/// An observation or option that cannot be used, or a rope that never is in the picture.
pub fn compare(
    observation: &Observation<'_>,
    options: &IdentifyOptions,
    rope: &RopeParams,
) -> Result<Compared, IdentifyError> {
    check(observation, options)?;
    let film = Film::new(observation, options);
    let clock = clock_window(
        &film.clamp(),
        observation.camera,
        observation.motion,
        options.clock_offset_max_s,
    );
    let camera = CorrectionPrior::new(options);
    let pixel_m = film.viewer.pixel_m();
    let coordinates =
        Coordinates::new(observation.appearance, pixel_m, clock, &camera, Reach::Wide);
    let mut x = point_of(rope);
    x[CLOCK] = clock.offset_s;
    let found = Comparer::new(&film, &coordinates).compare(&[x])?;
    let distance_px = found.first().map_or(INVISIBLE_PX, |c| c.distance_px);
    if distance_px >= INVISIBLE_PX {
        return Err(IdentifyError::NothingVisible);
    }
    Ok(Compared {
        distance_px,
        time_offset_s: clock.offset_s,
    })
}
