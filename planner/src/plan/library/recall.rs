//! A plan from the library, where it has a throw that is good enough.

use super::super::finalists::Finalist;
use super::super::setup::{Count, Point, Setup};
use super::super::{Dimensions, PlanError, PlanOptions, PlanRequest};
use super::ThrowLibrary;
use shared_types::{LimitedBy, Plan};

/// Throws of the library that are compared over several ropes, and how many of them are polished.
const COMPARED: usize = 4;
const POLISHED: usize = 2;

impl Setup<'_> {
    /// The plan of the best of the library's throws, polished. None where the library has no
    /// throws for such a request, or none that needs no search.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub(in super::super) fn recalled(&self, count: &mut Count) -> Result<Option<Plan>, PlanError> {
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
        let quick = Setup::new(self.task, &request)?;
        let found = quick.recall(library, count)?;
        if found.is_empty() {
            return Ok(None);
        }
        let finalists = quick.compare(found, POLISHED, count)?;
        let best: Option<Finalist> = finalists.into_iter().find(|f| quick.is_good(f));
        let Some(best) = best else {
            return Ok(None);
        };
        let plan = self.finish(best, count)?;
        Ok((plan.limited_by == Some(LimitedBy::Nothing)).then_some(plan))
    }

    /// The best of the library's throws with the rope planned for, best first.
    fn recall(&self, library: &ThrowLibrary, count: &mut Count) -> Result<Vec<Point>, PlanError> {
        let [x, y, z] = self.task.target_m();
        let wanted = self.request.options.recalled;
        let near = library.nearest(&self.request.rope, [x.hypot(y), z], 2 * wanted);
        let points = near.into_iter().map(|mut x| {
            // Neither turned nor stretched.
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
        best.truncate(COMPARED);
        Ok(best.into_iter().map(|(_, point)| point).collect())
    }

    /// Whether the library's throws are throws of this request.
    fn suits(&self, library: &ThrowLibrary) -> bool {
        let options = &self.request.options;
        let times_s = self.task.config().waypoint_times_s;
        let mut times_s = times_s.iter().zip(&library.times_s);
        let same_times = times_s.all(|(a, b)| (a - b).abs() < 1e-9);
        options.recalled > 0
            && options.dimensions == Dimensions::Planar
            && self.task.polishes()
            && same_times
            && self.request.ensemble.optimised.is_empty()
    }
}
