//! The search loop: draw, screen, value, learn.

use super::setup::{Count, Point, Setup};
use super::{PlanError, ThrowOutcome};
use arm_model::JointTrajectory;
use cmaes::{CmaEs, CmaOptions, StopRules};
use shared_types::ipc::message::Progress;
use std::ops::ControlFlow;

/// Where a search begins, how large it is, and when it ends early.
pub(super) struct Search<'a> {
    /// Mean of the first generation; the arm may execute it.
    pub(super) start: &'a [f64],
    /// Deviation of the first generation relative to the configured one.
    pub(super) spread: f64,
    /// Candidates per generation (paper: 60).
    pub(super) population: usize,
    /// Most generations (paper: 25 for striking).
    pub(super) generations: usize,
    pub(super) seed: u64,
    /// Task error that is good enough to stop (m).
    pub(super) stop_below_m: Option<f64>,
    /// Fraction of a generation that succeeds from which the search is done: wherever the
    /// distribution is drawn from, the task succeeds.
    pub(super) stop_success_fraction: Option<f64>,
    /// How many of the best candidates are kept.
    pub(super) keep: usize,
}

/// What one candidate is worth.
#[derive(Clone, Copy)]
pub(super) struct Valued {
    /// Smaller is better.
    pub(super) fitness: f64,
    /// Task error (m).
    pub(super) error_m: f64,
    pub(super) success: bool,
}

impl Setup<'_> {
    /// Runs CMA-ES over the waypoints. `value` sees one generation at a time. Interrupted
    /// by `progress`, it returns what it has: the best candidates, best first.
    ///
    /// # Errors
    /// Options the strategy refuses, a start outside the limits, errors of `value`.
    pub(super) fn explore(
        &self,
        search: &Search<'_>,
        value: impl Fn(&[JointTrajectory]) -> Result<Vec<Valued>, PlanError>,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<(Vec<Point>, Count), PlanError> {
        let (lower, upper) = self.space.bounds(&self.request.limits);
        let mut strategy = CmaEs::new(CmaOptions {
            mean: search.start.to_vec(),
            std_dev: self.std_dev.iter().map(|s| s * search.spread).collect(),
            lower,
            upper,
            population: search.population,
            draws_max: self.task.config().draws_max,
            seed: search.seed,
            stop: StopRules {
                generations_max: search.generations,
                step_tolerance: 1e-5,
                fitness_tolerance: 1e-6,
                ..StopRules::default()
            },
        })?;
        let mut best: Vec<(Valued, Point)> = Vec::new();
        let mut count = Count::default();
        loop {
            let points = strategy.ask(&mut |x| self.screen.accepts(x))?;
            let trajectories = points
                .iter()
                .map(|x| self.space.decode(x))
                .collect::<Result<Vec<_>, _>>()?;
            let values = value(&trajectories)?;
            let successes = values.iter().filter(|v| v.success).count();
            let success_fraction = successes as f64 / values.len().max(1) as f64;
            count.add(trajectories.len());
            strategy.tell(&values.iter().map(|v| v.fitness).collect::<Vec<_>>())?;
            best.extend(values.into_iter().zip(points.into_iter().zip(trajectories)));
            best.sort_by(|(a, _), (b, _)| a.fitness.total_cmp(&b.fitness));
            best.truncate(search.keep.max(1));
            let error_m = best[0].0.error_m;
            let go_on = progress(Progress {
                done: u32::try_from(strategy.generation()).unwrap_or(u32::MAX),
                total: u32::try_from(search.generations).unwrap_or(u32::MAX),
                value: 100.0 * error_m,
                label: "best cm".to_owned(),
            });
            count.interrupted = go_on.is_break();
            let is_close = search.stop_below_m.is_some_and(|e| error_m <= e);
            let enough = search.stop_success_fraction;
            let succeeds = enough.is_some_and(|e| success_fraction >= e);
            let stop = strategy.stop();
            if count.interrupted || is_close || succeeds || stop.is_some() {
                tracing::debug!(?stop, is_close, succeeds, "throw search ended");
                break;
            }
        }
        count.resampled = u32::try_from(strategy.resampled()).unwrap_or(u32::MAX);
        Ok((best.into_iter().map(|(_, point)| point).collect(), count))
    }

    /// One search from its own random numbers.
    pub(super) fn search(
        &self,
        round: usize,
        count: &mut Count,
        progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
    ) -> Result<Vec<Point>, PlanError> {
        let value = |trajectories: &[JointTrajectory]| {
            Ok(self.valued(trajectories, &self.thrown(trajectories)?))
        };
        let (found, spent) = self.explore(&self.search_of(round), value, progress)?;
        count.simulations += spent.simulations;
        count.resampled += spent.resampled;
        count.interrupted |= spent.interrupted;
        Ok(found)
    }

    /// What search `round` is.
    pub(super) fn search_of(&self, round: usize) -> Search<'_> {
        let (options, config) = (&self.request.options, self.task.config());
        Search {
            start: &self.start,
            spread: 1.0,
            population: options.population,
            generations: options.generations.unwrap_or(config.generations),
            seed: options.seed.wrapping_add((round as u64) << 40),
            stop_below_m: options.stop_below_m,
            stop_success_fraction: config.stop_success_fraction,
            keep: config.robustness.finalists,
        }
    }

    /// The rope planned for, thrown with the step that ranks.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub(super) fn thrown(
        &self,
        trajectories: &[JointTrajectory],
    ) -> Result<Vec<ThrowOutcome>, PlanError> {
        let own = self.own();
        let throws: Vec<_> = trajectories.iter().map(|t| (own, t)).collect();
        self.searching.run(&throws)
    }

    /// What throws are worth for what they did.
    pub(super) fn valued(
        &self,
        trajectories: &[JointTrajectory],
        outcomes: &[ThrowOutcome],
    ) -> Vec<Valued> {
        let rope = &self.request.rope;
        let valued = trajectories.iter().zip(outcomes).map(|(t, o)| Valued {
            fitness: self.fitness(rope, t, &self.widened(t, o)),
            error_m: self.task.error_m(o),
            success: o.finite && o.contacts.none() && self.task.judge(rope, o).success,
        });
        valued.collect()
    }
}
