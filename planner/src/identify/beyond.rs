//! What real ropes have beyond the nine parameters, fitted where the film shows it.
//!
//! A rest curvature, dry friction in bending and a swing at the film's begin are errors of a
//! plain fit's model, which takes them up in length, stiffness and the camera's place. Their
//! fit starts from the plain one, once for each of several kinds of friction, because how
//! it saturates has local minima. It counts only where it explains the film so much better
//! that chance cannot: a rope that has none of it keeps its plain fit.

use super::budget::Budget;
use super::coordinates::{
    CLAMP, Coordinates, FRICTION, LENGTH, LINKS, Point, SLIP, link_range, middle_links,
    nearest_links,
};
use super::descent::{DescentRules, best, descend, go_on};
use super::error::IdentifyError;
use super::film::{Fidelity, Film};
use super::offsets;
use super::refine::{Refined, SETTLED, refine};
use super::steps::moved_px;

/// Friction (1/m) and logarithm of its slip (1/m) at which the fit starts.
const STARTS: [(f64, f64); 3] = [(0.02, -0.7), (0.3, -1.2), (0.5, 0.3)];
/// Steps of each start before the best is chosen.
const CHOICE_STEPS: usize = 3;
/// Gain of the best start, promised by its slopes and then reached, below which the fit is not
/// made.
const PROMISE_MIN: f64 = 6.0;
/// Least gain in cost (half of a sum of squared deviations). By chance nine numbers
/// gain four or five; a real tracker's errors on nine films of plain ropes gained up to 42.
const GAIN_MIN: f64 = 50.0;
/// Cost, over the inflation, by which another start may be above the best after the same steps and
/// explain the film as well, and the difference of lengths (m) from which it is another rope.
const RIVAL_COST: f64 = 2.0;
const RIVAL_APART_M: f64 = 0.01;

/// The fit with everything that a real rope may have, where the film shows it, else the
/// plain one.
pub(super) fn beyond(
    film: &Film<'_>,
    coordinates: &Coordinates,
    plain: Refined,
    budget: &mut Budget<'_>,
) -> Result<Refined, IdentifyError> {
    let coordinates = coordinates.beyond(film.sight());
    let start = |(friction, slip): (f64, f64)| {
        let mut x: Point = plain.x;
        (x[FRICTION], x[SLIP]) = (friction, slip);
        x[CLAMP] = coordinates.prior_mean[CLAMP];
        x[LINKS] = f64::from(nearest_links(&x));
        x
    };
    let noise_px = plain.at.distance_px / 2.0_f64.sqrt();
    let rules = |iterations: usize| DescentRules {
        fidelity: Fidelity::Fine,
        links: middle_links(),
        noise: plain.noise,
        iterations,
        settled_below: SETTLED,
    };
    let starts = STARTS.map(start);
    // A plain fit says nothing about a slip or a clamp that could be likely or not.
    let mut without = plain.x;
    for i in [SLIP, CLAMP] {
        without[i] = coordinates.prior_mean[i];
    }
    let plain_cost = plain.at.normal(film, Fidelity::Fine, &plain.noise);
    let plain_cost = plain_cost.total_cost(&coordinates, &without);
    let begun = descend(film, &coordinates, &starts, &[], &rules(0), budget)?;
    let promised = begun.iter().map(|w| w.promised_cost(&coordinates));
    let promise = plain_cost - promised.fold(f64::INFINITY, f64::min);
    if promise < PROMISE_MIN {
        tracing::debug!(promise, "nothing beyond the nine parameters");
        return Ok(plain);
    }
    let candidates = go_on(film, &coordinates, begun, &rules(CHOICE_STEPS), budget)?;
    let ends: Vec<(f64, f64)> = candidates.iter().map(|w| (w.cost, w.x[LENGTH])).collect();
    let chosen = best(candidates)?;
    let promise = plain_cost - chosen.cost;
    if promise < PROMISE_MIN {
        tracing::debug!(
            promise,
            "nothing beyond the nine parameters after some steps"
        );
        return Ok(plain);
    }
    let found = refine(film, &coordinates, &chosen.x, noise_px, budget)?;
    let cost = |fit: &Refined, x: &Point| {
        let normal = fit.at.normal(film, Fidelity::Fine, &found.noise);
        normal.total_cost(&coordinates, x) - offsets::gain(&fit.at.rows, film, &found.noise)
            + counts_out_of_range(fit, &found)
    };
    // What the parts of the film disagree by is no evidence.
    let gain = (cost(&plain, &without) - cost(&found, &found.x)) / found.inflation;
    tracing::debug!(gain, inflation = found.inflation, x = ?found.x.as_slice(), "fit beyond the nine parameters");
    Ok(if gain > GAIN_MIN {
        Refined {
            rival_length_m: rival_length_m(&ends, found.inflation, found.x[LENGTH]),
            moved_px: moved_px(film, &found.x)?,
            ..found
        }
    } else {
        plain
    })
}

/// Of starts that ended at a cost with a length (m) each, the best first: the length farthest from
/// that of the fit among those that explain the film as well; none where they agree.
fn rival_length_m(ends: &[(f64, f64)], inflation: f64, found_m: f64) -> Option<f64> {
    let (least, _) = ends.first()?;
    let equal = ends
        .iter()
        .filter(|(cost, _)| cost - least < RIVAL_COST * inflation);
    let apart_m = |length_m: f64| (length_m - found_m).abs();
    let rival_m = equal
        .map(|(_, length_m)| *length_m)
        .max_by(|a, b| apart_m(*a).total_cmp(&apart_m(*b)))?;
    (apart_m(rival_m) > RIVAL_APART_M).then_some(rival_m)
}

/// What it costs a fit that its rope has a link count of the ranges, by what the fit with
/// everything knows about the count: a continuous rope asks for more links, which the
/// clamp's stiffness stands for.
fn counts_out_of_range(fit: &Refined, found: &Refined) -> f64 {
    let (low, high) = link_range();
    let inside = fit.x[LINKS].clamp(f64::from(low), f64::from(high));
    0.5 * (fit.x[LINKS] - inside).powi(2) / found.covariance[(LINKS, LINKS)].max(1e-9)
}

#[cfg(test)]
mod tests {
    use super::rival_length_m;

    #[test]
    fn a_start_that_explains_the_film_as_well_by_another_length_is_a_rival() {
        let ends = [(100.0, 0.50), (101.5, 0.53), (140.0, 0.70)];
        assert_eq!(rival_length_m(&ends, 1.0, 0.501), Some(0.53));
        // Worse by more than chance, or by no more than the film contradicts itself.
        assert_eq!(rival_length_m(&ends[..1], 1.0, 0.501), None);
        assert_eq!(rival_length_m(&[ends[0], ends[2]], 1.0, 0.501), None);
        assert_eq!(rival_length_m(&ends, 30.0, 0.501), Some(0.70));
        // The fit went on to where the other start was.
        assert_eq!(rival_length_m(&[(100.0, 0.52), ends[1]], 1.0, 0.528), None);
    }
}
