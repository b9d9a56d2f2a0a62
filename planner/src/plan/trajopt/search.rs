//! The search loop: draw, screen, value, learn.

use super::super::error::{PlanError, PlanProgress};
use super::decode::WaypointSpace;
use super::screen::Screen;
use arm_model::JointTrajectory;
use cmaes::{CmaEs, CmaOptions, StopReason, StopRules};
use std::ops::ControlFlow;

/// Size and spread of a search.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SearchOptions {
    /// Mean of the first generation; the arm may execute it.
    pub start: Vec<f64>,
    /// Candidates per generation (paper: 60).
    pub population: usize,
    /// Most generations (paper: 25 for striking).
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Deviation of the first generation per coordinate, in its unit.
    pub std_dev: Vec<f64>,
    /// Draws of one candidate before it is pulled towards the mean.
    pub draws_max: usize,
    /// Error that is good enough to stop (m).
    pub stop_below_m: Option<f64>,
    /// Fraction of a generation that succeeds from which the search is done: wherever the
    /// distribution is drawn from, the task succeeds.
    pub stop_success_fraction: Option<f64>,
    /// How many of the best candidates are kept.
    pub keep: usize,
}

/// What a task says about one candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Valued {
    /// Fitness, smaller is better.
    pub fitness: f64,
    /// Task error (m).
    pub error_m: f64,
    /// Whether the throw succeeds.
    pub success: bool,
}

/// Values one generation of candidates.
pub(crate) type Value<'a> = dyn FnMut(&[JointTrajectory]) -> Result<Vec<Valued>, PlanError> + 'a;

/// One valued candidate.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Found {
    /// Its point in the space.
    pub x: Vec<f64>,
    /// Its trajectory.
    pub trajectory: JointTrajectory,
    /// What the task says.
    pub valued: Valued,
}

/// What a search found.
#[derive(Debug, Clone)]
pub(crate) struct SearchResult {
    /// Best candidates, best first, at most `keep`.
    pub best: Vec<Found>,
    /// Whether `progress` broke it off.
    pub interrupted: bool,
    /// Candidates valued.
    pub simulations: u32,
    /// Candidates drawn again because they broke a limit.
    pub resampled: u32,
}

/// Runs CMA-ES over `space`. `value` sees one generation at a time. Broken off by
/// `progress`, it returns what it has.
///
/// # Errors
/// Options the strategy refuses, a start pose outside the limits, errors of `value`.
pub(crate) fn search(
    space: &WaypointSpace,
    screen: &Screen,
    bounds: (Vec<f64>, Vec<f64>),
    options: &SearchOptions,
    value: &mut Value<'_>,
    progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
) -> Result<SearchResult, PlanError> {
    let mut strategy = CmaEs::new(CmaOptions {
        mean: options.start.clone(),
        std_dev: options.std_dev.clone(),
        lower: bounds.0,
        upper: bounds.1,
        population: options.population,
        draws_max: options.draws_max,
        seed: options.seed,
        stop: StopRules {
            generations_max: options.generations,
            step_tolerance: 1e-5,
            fitness_tolerance: 1e-6,
            ..StopRules::default()
        },
    })?;
    let mut best: Vec<Found> = Vec::new();
    let mut simulations = 0;
    let mut interrupted = false;
    let stop = loop {
        let points = strategy.ask(&mut |x| screen.accepts(x))?;
        let trajectories = points
            .iter()
            .map(|x| space.decode(x))
            .collect::<Result<Vec<_>, _>>()?;
        let values = value(&trajectories)?;
        let success_fraction =
            values.iter().filter(|v| v.success).count() as f64 / values.len().max(1) as f64;
        simulations += trajectories.len();
        strategy.tell(&values.iter().map(|v| v.fitness).collect::<Vec<_>>())?;
        let all = points.into_iter().zip(trajectories).zip(values);
        best.extend(all.map(|((x, trajectory), valued)| Found {
            x,
            trajectory,
            valued,
        }));
        best.sort_by(|a, b| a.valued.fitness.total_cmp(&b.valued.fitness));
        best.truncate(options.keep.max(1));
        let leader = best[0].valued;
        let go_on = progress(PlanProgress {
            generation: strategy.generation(),
            generations: options.generations,
            fitness: leader.fitness,
            error_m: leader.error_m,
            simulations,
        });
        if go_on.is_break() {
            interrupted = true;
            break StopReason::Generations;
        }
        if options.stop_below_m.is_some_and(|e| leader.error_m <= e) {
            break StopReason::FitnessTarget;
        }
        if options
            .stop_success_fraction
            .is_some_and(|p| success_fraction >= p)
        {
            break StopReason::FitnessTarget;
        }
        if let Some(reason) = strategy.stop() {
            break reason;
        }
    };
    tracing::debug!(?stop, simulations, "throw search ended");
    Ok(SearchResult {
        best,
        interrupted,
        simulations: u32::try_from(simulations).unwrap_or(u32::MAX),
        resampled: u32::try_from(strategy.resampled()).unwrap_or(u32::MAX),
    })
}
