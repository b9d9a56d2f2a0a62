//! Where a refinement starts.
//!
//! A proposal comes from a network, or from a fast search of the simulator's own: a
//! bank of ropes drawn from the ranges is compared with the film, and the likeliest
//! ones are improved side by side by a few coarse Gauss-Newton steps.

use super::budget::Budget;
use super::coarse::{Compared, Comparer};
use super::coordinates::{
    CLOCK, Coordinates, DAMPING, INERTIA, LEAD_MASS, LENGTH, LINKS, Point, STIFFNESS, middle_links,
    point_of,
};
use super::descent::{DescentRules, Iterate, best, descend, go_on};
use super::error::IdentifyError;
use super::film::{Fidelity, Film};
use super::noise::Noise;
use crate::ropes::random_rope;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use shared_types::RopeParams;

/// Ropes of the bank.
const BANK: usize = 192;
/// Ropes improved.
const STARTS: usize = 6;
/// Coarse steps of all of them, and of those that have come furthest.
const FIRST_STEPS: usize = 4;
const LAST_STEPS: usize = 10;
/// How many of them go on.
const FINALISTS: usize = 2;
/// Noise assumed while searching (px): only its ratio to the priors counts, which are
/// weak.
const NOISE_PX: f64 = 4.0;
/// Two ropes of the bank closer than this, in parts of the box, start the same descent.
const APART: f64 = 0.12;

/// Where the refinement may start: the likeliest rope of the ranges.
pub(super) fn fast_search(
    film: &Film<'_>,
    coordinates: &Coordinates,
    budget: &mut Budget<'_>,
) -> Result<Iterate, IdentifyError> {
    let bank = bank(coordinates, film.options.seed);
    let mut ranked = Comparer::new(film, coordinates).compare(&bank)?;
    ranked.sort_by(|a, b| a.distance_px.total_cmp(&b.distance_px));
    budget.step(bank.len(), ranked[0].distance_px)?;
    let mut starts: Vec<Point> = Vec::new();
    for Compared { x: start, .. } in ranked {
        if starts.iter().all(|s| apart(coordinates, s, &start) > APART) {
            starts.push(start);
        }
        if starts.len() == STARTS {
            break;
        }
    }
    improve(film, coordinates, &starts, budget)
}

/// Coarse steps from a rope that something else proposes.
pub(super) fn from_proposal(
    film: &Film<'_>,
    coordinates: &Coordinates,
    proposed: &RopeParams,
    budget: &mut Budget<'_>,
) -> Result<Iterate, IdentifyError> {
    let x = searchable(coordinates, point_of(proposed));
    let compared = Comparer::new(film, coordinates).compare(&[x])?;
    let starts: Vec<Point> = compared.iter().map(|c| c.x).collect();
    improve(film, coordinates, &starts, budget)
}

/// A point with everything that coarse steps leave alone at its likeliest.
fn searchable(coordinates: &Coordinates, mut x: Point) -> Point {
    x[INERTIA] = coordinates.prior_mean[INERTIA];
    x[LINKS] = f64::from(middle_links());
    x[CLOCK] = coordinates.prior_mean[CLOCK];
    coordinates.clamped(&x)
}

/// Coarse steps from some starts; the best that they lead to.
fn improve(
    film: &Film<'_>,
    coordinates: &Coordinates,
    starts: &[Point],
    budget: &mut Budget<'_>,
) -> Result<Iterate, IdentifyError> {
    let rules = |iterations| DescentRules {
        fidelity: Fidelity::Coarse,
        links: middle_links(),
        noise: Noise::white(NOISE_PX),
        iterations,
        settled_below: 0.05,
    };
    let first = rules(FIRST_STEPS);
    let mut iterates = descend(film, coordinates, starts, &[], &first, budget)?;
    iterates.truncate(FINALISTS);
    let last = rules(LAST_STEPS);
    best(go_on(film, coordinates, iterates, &last, budget)?)
}

/// Ropes drawn from the ranges.
fn bank(coordinates: &Coordinates, seed: u64) -> Vec<Point> {
    let mut rng = ChaCha12Rng::seed_from_u64(seed ^ 0xba4c_0000);
    (0..BANK)
        .map(|_| searchable(coordinates, point_of(&random_rope(rng.random()))))
        .collect()
}

/// Largest distance of two ropes in one coordinate, in parts of the box.
fn apart(c: &Coordinates, a: &Point, b: &Point) -> f64 {
    [LENGTH, STIFFNESS, DAMPING, LEAD_MASS]
        .into_iter()
        .map(|i| (a[i] - b[i]).abs() / (c.upper[i] - c.lower[i]))
        .fold(0.0, f64::max)
}
