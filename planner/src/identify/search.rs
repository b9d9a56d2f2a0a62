//! Φ-CMA-ES: the global search of the paper's baseline.
//!
//! 60 candidates by 50 generations minimise the pixel distance between seen and
//! simulated keypoints, over all nine parameters but for what no film shows: the
//! common factor of stiffness, damping and masses, and which of radius and extra scale
//! makes the link inertia. The link count is searched as a real number and rounded.

use super::budget::Budget;
use super::coarse::{Compared, Comparer, INVISIBLE_PX};
use super::coordinates::{CAMERA, Coordinates, Point};
use super::error::IdentifyError;
use super::film::Film;
use super::options::IdentifyOptions;
use cmaes::{CmaEs, CmaOptions, StopRules};

/// The global search; repeated from other random numbers, `repeats_max` times at most,
/// where it was caught in a side minimum.
pub(super) fn search(
    film: &Film<'_>,
    coordinates: &Coordinates,
    repeats_max: usize,
    budget: &mut Budget<'_>,
) -> Result<Compared, IdentifyError> {
    let options = &film.options;
    let comparer = Comparer::new(film, coordinates);
    let mut found = once(&comparer, coordinates, options, options.seed, budget)?;
    for repeat in 1..=repeats_max as u64 {
        if found.distance_px <= options.repeat_above_px {
            break;
        }
        let seed = options.seed.wrapping_add(repeat << 32);
        let again = once(&comparer, coordinates, options, seed, budget)?;
        if again.distance_px < found.distance_px {
            found = again;
        }
    }
    Ok(found)
}

fn once(
    comparer: &Comparer<'_>,
    coordinates: &Coordinates,
    options: &IdentifyOptions,
    seed: u64,
    budget: &mut Budget<'_>,
) -> Result<Compared, IdentifyError> {
    let part = |x: &Point| x.as_slice()[..CAMERA].to_vec();
    let spread = (coordinates.upper - coordinates.lower) / 5.0;
    let mut strategy = CmaEs::new(CmaOptions {
        mean: part(&coordinates.clamped(&coordinates.prior_mean)),
        std_dev: part(&spread),
        lower: part(&coordinates.lower),
        upper: part(&coordinates.upper),
        population: options.population,
        draws_max: 1,
        seed,
        stop: StopRules {
            generations_max: options.generations,
            ..StopRules::default()
        },
    })?;
    let mut found: Option<Compared> = None;
    let mut history = Vec::new();
    loop {
        let requested = strategy.ask(&mut |_| true)?;
        let points: Vec<Point> = requested
            .iter()
            .map(|x| Point::from_fn(|i, _| x.get(i).copied().unwrap_or(0.0)))
            .collect();
        let compared = comparer.compare(&points)?;
        let fitness: Vec<f64> = compared.iter().map(|c| c.distance_px).collect();
        strategy.tell(&fitness)?;
        for c in compared {
            if c.distance_px < found.map_or(INVISIBLE_PX, |f| f.distance_px) {
                found = Some(c);
            }
        }
        let best = found.ok_or(IdentifyError::NothingVisible)?;
        budget.step(points.len(), best.distance_px)?;
        history.push(best.distance_px);
        if strategy.stop().is_some() || (options.early_stop && stalled(&history)) {
            return Ok(best);
        }
    }
}

/// Whether the best distance has all but ceased to fall: from there the refinement
/// goes on faster.
fn stalled(history: &[f64]) -> bool {
    const WINDOW: usize = 10;
    const PART: f64 = 0.005;
    let now = history.len();
    now > 2 * WINDOW && history[now - 1] > (1.0 - PART) * history[now - 1 - WINDOW]
}
