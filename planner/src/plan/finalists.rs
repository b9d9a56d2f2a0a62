//! The throws that are compared at the end: polished, and observed with all ropes.

use super::setup::{Count, Point, Setup};
use super::{PlanError, ThrowOutcome};
use arm_model::JointTrajectory;

/// A throw that is compared at the end.
#[derive(Debug, Clone)]
pub(super) struct Finalist {
    pub(super) x: Vec<f64>,
    pub(super) trajectory: JointTrajectory,
    /// Outcome with the rope planned for.
    pub(super) outcome: ThrowOutcome,
    /// Smaller is better.
    pub(super) score: f64,
    /// Fraction of the ropes compared with which the task succeeds.
    successes: f64,
    /// Whether outcome, score and successes come from double precision at half the step.
    is_exact: bool,
}

/// Finalists of one search whose own rope is simulated again exactly: as many as a
/// processor's double precision simulates at once.
const LOOKED_AT_AGAIN: usize = 8;
/// Of these, how many at most are judged exactly with all ropes.
const JUDGED_EXACTLY: usize = 3;

pub(super) fn best_first(finalists: &mut [Finalist]) {
    finalists.sort_by(|a, b| a.score.total_cmp(&b.score));
}

impl Setup<'_> {
    /// The best of a search with all ropes; so many of them polished.
    pub(super) fn compare(
        &self,
        found: Vec<Point>,
        polished: usize,
        count: &mut Count,
    ) -> Result<Vec<Finalist>, PlanError> {
        let mut finalists = self.finalists(found, count)?;
        if self.task.polishes() {
            let best = finalists.iter().take(polished).map(|f| f.x.clone());
            let polished = self.polish(best.collect(), count)?;
            let points = polished.into_iter().map(|x| {
                let trajectory = self.space.decode(&x)?;
                Ok((x, trajectory))
            });
            let points = points.collect::<Result<Vec<_>, PlanError>>()?;
            finalists.extend(self.finalists(points, count)?);
            best_first(&mut finalists);
        }
        Ok(finalists)
    }

    /// Throws observed to the end with all ropes, the best first. One that lets the arm
    /// collide is none.
    pub(super) fn finalists(
        &self,
        points: Vec<Point>,
        count: &mut Count,
    ) -> Result<Vec<Finalist>, PlanError> {
        let mut out = self.judged(points, false, count)?;
        best_first(&mut out);
        Ok(out)
    }

    /// Judges the best again exactly, until the best is one that was.
    ///
    /// Whether a domino falls can hang on the arithmetic: a throw for which it does is
    /// not one to make.
    pub(super) fn confirm(
        &self,
        finalists: &mut Vec<Finalist>,
        count: &mut Count,
    ) -> Result<(), PlanError> {
        if finalists.first().is_none_or(|best| best.is_exact) {
            return Ok(());
        }
        self.look_again(finalists, count)?;
        for _ in 1..JUDGED_EXACTLY {
            if finalists.first().is_none_or(|best| best.is_exact) {
                return Ok(());
            }
            let best = finalists.remove(0);
            finalists.extend(self.judged(vec![(best.x, best.trajectory)], true, count)?);
            best_first(finalists);
        }
        Ok(())
    }

    /// Throws the best few again exactly with the rope planned for, which demotes those
    /// that fail, and the very best with all ropes. At once: these are two full batches.
    fn look_again(
        &self,
        finalists: &mut Vec<Finalist>,
        count: &mut Count,
    ) -> Result<(), PlanError> {
        let (own, others) = (self.own(), self.at_start().skip(1));
        let seen = finalists.len().min(LOOKED_AT_AGAIN);
        let again = finalists[..seen].iter();
        let mut throws: Vec<_> = again.map(|f| (own, &f.trajectory)).collect();
        throws.extend(others.map(|rope| (rope, &finalists[0].trajectory)));
        let mut outcomes = self.judging.exact().run(&throws)?;
        count.add(throws.len());
        let of_others = outcomes.split_off(seen);
        for (finalist, outcome) in finalists.iter_mut().zip(&outcomes).skip(1) {
            if !(outcome.finite && self.task.judge(own.rope, outcome).success) {
                finalist.score += 1.0;
            }
        }
        let best = finalists.remove(0);
        let own = outcomes.into_iter().take(1).chain(of_others).collect();
        finalists.extend(self.finalist((best.x, best.trajectory), own, true));
        best_first(finalists);
        Ok(())
    }

    /// Throws observed to the end with all ropes, without those that let the arm collide.
    pub(super) fn judged(
        &self,
        points: Vec<Point>,
        is_exact: bool,
        count: &mut Count,
    ) -> Result<Vec<Finalist>, PlanError> {
        let throws: Vec<_> = points
            .iter()
            .flat_map(|(_, t)| self.at_start().map(move |rope| (rope, t)))
            .collect();
        let exact = is_exact.then(|| self.judging.exact());
        let mut outcomes = exact.as_ref().unwrap_or(&self.judging).run(&throws)?;
        count.add(throws.len());
        let mut of_one = || outcomes.drain(..self.ropes.len()).collect();
        Ok(points
            .into_iter()
            .filter_map(|point| self.finalist(point, of_one(), is_exact))
            .collect())
    }

    /// A throw with its outcomes, one per rope; none if it lets the arm collide.
    fn finalist(
        &self,
        (x, trajectory): Point,
        outcomes: Vec<ThrowOutcome>,
        is_exact: bool,
    ) -> Option<Finalist> {
        let own = outcomes.first()?;
        if !own.finite || own.contacts.pole_robot > 0 {
            return None;
        }
        let count = outcomes.len().max(1) as f64;
        let squares: f64 = outcomes.iter().map(|o| self.task.error_m(o).powi(2)).sum();
        let good = self.ropes.iter().zip(&outcomes);
        let good = good.filter(|(rope, o)| o.finite && self.task.judge(rope, o).success);
        let successes = good.count() as f64 / count;
        let contacts = self.task.config().weights.contacts(&outcomes[0].contacts);
        Some(Finalist {
            x,
            trajectory,
            score: (squares / count).sqrt() + contacts + (1.0 - successes),
            successes,
            is_exact,
            outcome: outcomes.into_iter().next().unwrap_or_default(),
        })
    }

    /// Whether a throw comes close enough, where that is what counts.
    pub(super) fn is_close(&self, outcome: &ThrowOutcome) -> bool {
        let good_enough_m = self.request.options.good_enough_m;
        !self.task.polishes() || self.task.error_m(outcome) <= good_enough_m
    }

    /// Whether no further search is needed.
    pub(super) fn is_good(&self, finalist: &Finalist) -> bool {
        // All but one of the ropes compared.
        const SUCCESSES: f64 = 0.85;
        let outcome = &finalist.outcome;
        self.is_close(outcome) && finalist.successes >= SUCCESSES && outcome.contacts.none()
    }
}
