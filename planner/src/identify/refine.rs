//! Refinement of a proposal against every pixel, and how well it is known.
//!
//! Gauss-Newton steps under a noise whose size and correlations are estimated from the
//! residuals themselves, in turns. The covariance is the inverse of the whitened
//! normal equations, widened where the parts of the film disagree by more than it says.

use super::budget::Budget;
use super::coordinates::{Coordinates, Point, Square, middle_links, nearest_links};
use super::descent::{DescentRules, Iterate, best, descend, go_on};
use super::error::IdentifyError;
use super::film::{Fidelity, Film};
use super::linear::{Linearised, Normal};
use super::noise::Noise;
use super::offsets;

/// Most steps: until the noise is known, with its first estimate, and with the second at
/// the likeliest link count.
const FIRST_STEPS: usize = 6;
const SECOND_STEPS: usize = 5;
const LAST_STEPS: usize = 4;
/// A cost lower by less than this is no better: a tenth of a deviation.
pub(super) const SETTLED: f64 = 5e-3;

/// A refined fit.
#[derive(Debug, Clone)]
pub(super) struct Refined {
    pub(super) x: Point,
    /// Residuals and slopes there.
    pub(super) at: Linearised,
    /// Covariance of the coordinates, their fitting prior included.
    pub(super) covariance: Square,
    /// What errors that last through the film add to it, however well its parts agree.
    pub(super) lasting: Square,
    pub(super) noise: Noise,
    /// Factor by which the parts of the film disagree more than the noise says,
    /// variance; 1 or more.
    pub(super) inflation: f64,
    /// Length (m) of another rope that explains the film as well; none where all starts agree.
    pub(super) rival_length_m: Option<f64>,
    /// How far keypoints move with the simulation's step halved (px, root mean square).
    pub(super) moved_px: f64,
}

/// Refines the fit from a start.
pub(super) fn refine(
    film: &Film<'_>,
    coordinates: &Coordinates,
    start: &Point,
    noise_px: f64,
    budget: &mut Budget<'_>,
) -> Result<Refined, IdentifyError> {
    let rules = |links: u32, noise: Noise, iterations: usize| DescentRules {
        fidelity: Fidelity::Fine,
        links,
        noise,
        iterations,
        settled_below: SETTLED,
    };
    let estimate = |w: &Iterate| {
        Noise::estimate(film.grid(Fidelity::Fine), &w.at.rows).at_least(film.options.noise_min_px)
    };
    let middle = middle_links();
    let first = rules(middle, Noise::white(noise_px), FIRST_STEPS);
    let starts = [*start];
    let mut iterate = best(descend(film, coordinates, &starts, &[], &first, budget)?)?;
    let second = rules(middle, estimate(&iterate), SECOND_STEPS);
    let again = Iterate::new(film, coordinates, &second, iterate.x, iterate.at);
    iterate = best(go_on(film, coordinates, vec![again], &second, budget)?)?;
    let last = rules(nearest_links(&iterate.x), estimate(&iterate), LAST_STEPS);
    let (starts, near) = ([iterate.x], [&iterate.at.rows]);
    iterate = best(descend(film, coordinates, &starts, &near, &last, budget)?)?;
    let noise = estimate(&iterate);
    let normal = iterate.at.normal(film, Fidelity::Fine, &noise);
    let covariance = (normal.information + coordinates.prior_information())
        .cholesky()
        .map_or_else(|| coordinates.prior_information(), |f| f.inverse());
    let inflation = disagreement(&normal, &covariance, coordinates.fitted).max(1.0);
    let rows = (&iterate.at.rows, coordinates.fitted);
    let std_px = film.options.keypoint_offset_std_px;
    Ok(Refined {
        lasting: offsets::covariance(rows, &covariance, film, &noise, std_px),
        x: iterate.x,
        at: iterate.at,
        covariance,
        noise,
        inflation,
        rival_length_m: None,
        moved_px: 0.0,
    })
}

/// Spread of the gradient over the parts of the film, relative to what the normal
/// equations expect, averaged over all directions.
fn disagreement(normal: &Normal, covariance: &Square, fitted: usize) -> f64 {
    let parts = normal.parts.len() as f64;
    if parts < 3.0 {
        return 1.0;
    }
    let mean = normal.gradient / parts;
    let spread = normal.parts.iter().map(|g| {
        let d = g - mean;
        (covariance * d).dot(&d)
    });
    let seen = (covariance * normal.information).trace();
    spread.sum::<f64>() * parts / (parts - 1.0) / seen.clamp(1.0, fitted as f64)
}
