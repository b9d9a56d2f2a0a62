//! A plan from the library, where it has a throw that is good enough.

use super::super::finalists::Finalist;
use super::super::search::Valued;
use super::super::setup::{Count, Point, Setup};
use super::super::{Dimensions, PlanError, PlanOptions, PlanRequest, ThrowOutcome};
use super::ThrowLibrary;
use nalgebra::Vector3;
use shared_types::Plan;
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Throws of the library that are compared over several ropes, and how many are polished of them.
const COMPARED: usize = 6;
const POLISHED: usize = 2;

impl Setup<'_> {
    /// The plan of the best of the library's throws, polished. None where the library has no
    /// throws for such a request, or none that needs no search, and when `progress`, which is told
    /// of them once, interrupts.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub(in super::super) fn recalled(
        &self,
        count: &mut Count,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Option<Plan>, PlanError> {
        let library = ThrowLibrary::embedded().filter(|library| self.suits(library));
        let Some(library) = library else {
            return Ok(None);
        };
        // The step that ranks is fine enough for all but the last look, in which a rope that
        // wants a finer one is found out.
        let options = PlanOptions {
            step_s: self.searching.step_s,
            ..self.request.options
        };
        let request = PlanRequest {
            options,
            ..self.request.clone()
        };
        let quick = Setup::from_states(self.task, &request, Some(self.states.clone()))?;
        let found = quick.recall(library, count)?;
        let Some((nearest, _)) = found.first() else {
            return Ok(None);
        };
        let compared = Progress {
            done: 1,
            total: 1,
            value: 100.0 * nearest.error_m,
            label: "best cm".to_owned(),
        };
        if progress(compared).is_break() {
            return Ok(None);
        }
        let points = found.into_iter().map(|(_, point)| point).collect();
        let best = quick.least_spread(points, count)?;
        for x in quick.polish(best, count)? {
            let point = (x.clone(), self.space.decode(&x)?);
            // What the search's step hides is found out here.
            let judged = self.judged(vec![point], true, count)?;
            if let Some(best) = judged.into_iter().find(|f| self.is_met(f)) {
                return self
                    .written(best.trajectory, &best.outcome, count)
                    .map(Some);
            }
        }
        Ok(None)
    }

    /// The throws whose tip comes to nearly the same place whatever is left open about the
    /// rope, the best first: a miss that all ropes share is polished away.
    fn least_spread(
        &self,
        points: Vec<Point>,
        count: &mut Count,
    ) -> Result<Vec<Vec<f64>>, PlanError> {
        // One variant per parameter: the other goes the other way.
        let ropes = self.at_start().take(self.ropes.len() / 2 + 1);
        let throws: Vec<_> = points
            .iter()
            .flat_map(|(_, t)| ropes.clone().map(move |rope| (rope, t)))
            .collect();
        count.add(throws.len());
        let outcomes = self.judging.run(&throws)?;
        let spread_m = |outcomes: &[ThrowOutcome]| {
            let place = |o: &ThrowOutcome| o.watched.to_point.map(|c| Vector3::from(c.tip_m));
            let own = place(outcomes.first()?)?;
            let squares = outcomes
                .iter()
                .map(|o| Some((place(o)? - own).norm_squared()));
            squares.sum::<Option<f64>>().map(f64::sqrt)
        };
        let spreads = outcomes.chunks(ropes.count()).map(spread_m);
        let mut known: Vec<_> = spreads
            .zip(points)
            .filter_map(|(spread_m, (x, _))| Some((spread_m?, x)))
            .collect();
        known.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        let polished = POLISHED.min(self.task.config().robustness.polished);
        Ok(known.into_iter().take(polished).map(|(_, x)| x).collect())
    }

    /// Whether a throw meets its target, touches nothing and keeps every limit.
    fn is_met(&self, throw: &Finalist) -> bool {
        let request = self.request;
        self.is_good(throw)
            && self.task.judge(&request.rope, &throw.outcome).success
            && request.limits.worst_violation(&throw.trajectory).is_none()
    }

    /// The best of the library's throws with the rope planned for, best first, and what they are
    /// worth.
    fn recall(
        &self,
        library: &ThrowLibrary,
        count: &mut Count,
    ) -> Result<Vec<(Valued, Point)>, PlanError> {
        let [x, y, z] = self.task.target_m();
        let wanted = self.request.options.library_candidates;
        let near = library.nearest(&self.request.rope, [x.hypot(y), z], 2 * wanted);
        let points = near.into_iter().map(|mut x| {
            // Not turned.
            x.resize(self.space.count(), 0.0);
            x
        });
        let points: Vec<Vec<f64>> = points
            .filter(|x| self.screen.accepts(x))
            .take(wanted)
            .collect();
        let trajectories = points
            .iter()
            .map(|x| self.space.decode(x))
            .collect::<Result<Vec<_>, _>>()?;
        count.add(trajectories.len());
        let outcomes = self.thrown(&trajectories)?;
        let values = self.valued(&trajectories, &outcomes);
        let mut best: Vec<_> = values
            .into_iter()
            .zip(points.into_iter().zip(trajectories))
            .collect();
        best.sort_by(|(a, _), (b, _)| a.fitness.total_cmp(&b.fitness));
        best.truncate(COMPARED.min(self.task.config().robustness.finalists.max(1)));
        Ok(best)
    }

    /// Whether the library's throws are throws of this request.
    fn suits(&self, library: &ThrowLibrary) -> bool {
        let options = &self.request.options;
        let times_s = self.task.config().waypoint_times_s;
        let mut times_s = times_s.iter().zip(&library.times_s);
        let same_times = times_s.all(|(a, b)| (a - b).abs() < 1e-9);
        options.library_candidates > 0
            && !self.space.is_timed()
            && options.dimensions == Dimensions::Planar
            && self.task.polishes()
            && same_times
            && self.request.ensemble.optimised.is_empty()
    }
}
