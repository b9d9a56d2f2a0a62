//! Damped Gauss-Newton (Levenberg-Marquardt) steps, several starts side by side.

use super::budget::Budget;
use super::coordinates::{Coordinates, Point, Square};
use super::error::IdentifyError;
use super::film::{Fidelity, Film};
use super::linear::{Linearised, Normal, linearise};
use super::noise::{Noise, Rows};

/// Damping of the first step, relative to the diagonal.
const DAMPING_FIRST: f64 = 1e-3;
/// Damping beyond which a start is given up.
const DAMPING_MAX: f64 = 1e6;

/// Where one start has come to.
#[derive(Debug, Clone)]
pub(super) struct Iterate {
    pub(super) x: Point,
    pub(super) at: Linearised,
    pub(super) normal: Normal,
    /// Cost with the prior.
    pub(super) cost: f64,
    damping: f64,
    settled: bool,
}

/// Rules of a descent.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescentRules {
    pub(super) fidelity: Fidelity,
    /// Links of the simulated ropes.
    pub(super) links: u32,
    pub(super) noise: Noise,
    /// Most evaluations after the first.
    pub(super) iterations: usize,
    /// A start has settled when a step lowers the cost by less than this.
    pub(super) settled_below: f64,
}

/// Descends from every start; the iterates that could be simulated at all, the lowest
/// cost first. `near` as in [`linearise`].
pub(super) fn descend(
    film: &Film<'_>,
    coordinates: &Coordinates,
    starts: &[Point],
    near: &[&Rows],
    rules: &DescentRules,
    budget: &mut Budget<'_>,
) -> Result<Vec<Iterate>, IdentifyError> {
    let starts: Vec<Point> = starts.iter().map(|x| coordinates.clamped(x)).collect();
    let (found, simulations) = linearise(
        film,
        &starts,
        near,
        rules.links,
        coordinates.fitted,
        rules.fidelity,
    )?;
    let iterates: Vec<Iterate> = starts
        .iter()
        .zip(found)
        .filter_map(|(x, at)| Some(Iterate::new(film, coordinates, rules, *x, at?)))
        .collect();
    budget.step(simulations, best_px(&iterates))?;
    go_on(film, coordinates, iterates, rules, budget)
}

/// Descends from where some iterates are.
pub(super) fn go_on(
    film: &Film<'_>,
    coordinates: &Coordinates,
    mut iterates: Vec<Iterate>,
    rules: &DescentRules,
    budget: &mut Budget<'_>,
) -> Result<Vec<Iterate>, IdentifyError> {
    for _ in 0..rules.iterations {
        let trials: Vec<(usize, Point)> = iterates
            .iter_mut()
            .enumerate()
            .filter(|(_, w)| !w.settled)
            .filter_map(|(i, w)| Some((i, w.trial(coordinates)?)))
            .collect();
        if trials.is_empty() {
            break;
        }
        let points: Vec<Point> = trials.iter().map(|(_, x)| *x).collect();
        let near: Vec<&Rows> = trials.iter().map(|(i, _)| &iterates[*i].at.rows).collect();
        let (found, simulations) = linearise(
            film,
            &points,
            &near,
            rules.links,
            coordinates.fitted,
            rules.fidelity,
        )?;
        for ((i, x), at) in trials.into_iter().zip(found) {
            let there = at.map(|at| Iterate::new(film, coordinates, rules, x, at));
            iterates[i].judge(there, rules);
        }
        budget.step(simulations, best_px(&iterates))?;
    }
    iterates.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    Ok(iterates)
}

/// The first of iterates in the order of [`descend`].
pub(super) fn best(iterates: Vec<Iterate>) -> Result<Iterate, IdentifyError> {
    let best = iterates.into_iter().next();
    best.ok_or(IdentifyError::NothingVisible)
}

fn best_px(iterates: &[Iterate]) -> f64 {
    let distances = iterates.iter().map(|w| w.at.distance_px);
    distances.fold(f64::INFINITY, f64::min)
}

impl Iterate {
    pub(super) fn new(
        film: &Film<'_>,
        coordinates: &Coordinates,
        rules: &DescentRules,
        x: Point,
        at: Linearised,
    ) -> Self {
        let normal = at.normal(film, rules.fidelity, &rules.noise);
        Self {
            cost: normal.total_cost(coordinates, &x),
            x,
            at,
            normal,
            damping: DAMPING_FIRST,
            settled: false,
        }
    }

    /// The normal equations with the prior.
    fn equations(&self, coordinates: &Coordinates) -> (Square, Point) {
        (
            self.normal.information + coordinates.prior_information(),
            self.normal.gradient + coordinates.prior_gradient(&self.x),
        )
    }

    /// The cost that an undamped step leads to if everything is linear; less than any real step
    /// reaches, but for a curve that happens to help.
    pub(super) fn promised_cost(&self, coordinates: &Coordinates) -> f64 {
        let (normal, gradient) = self.equations(coordinates);
        let step = normal.cholesky().map(|factors| factors.solve(&gradient));
        step.map_or(self.cost, |step| self.cost - 0.5 * step.dot(&gradient))
    }

    /// The point a damped step leads to; `None` if there is no step.
    fn trial(&mut self, coordinates: &Coordinates) -> Option<Point> {
        let (normal, gradient) = self.equations(coordinates);
        let damped = normal + Square::from_diagonal(&(normal.diagonal() * self.damping));
        let step = damped.cholesky().map(|f| f.solve(&gradient));
        self.settled = step.is_none();
        step.map(|step| coordinates.clamped(&(self.x - step)))
    }

    /// Goes to the trial if it is better.
    fn judge(&mut self, there: Option<Self>, rules: &DescentRules) {
        match there {
            Some(there) if there.cost < self.cost => {
                let settled = self.cost - there.cost < rules.settled_below;
                let damping = (self.damping / 8.0).max(1e-9);
                *self = Self {
                    damping,
                    settled,
                    ..there
                };
            }
            Some(there) if there.cost - self.cost < rules.settled_below => self.settled = true,
            _ => {
                self.damping *= 20.0;
                self.settled = self.damping > DAMPING_MAX;
            }
        }
    }
}
