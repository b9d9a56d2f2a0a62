//! The search loop: draw, screen, value, learn.

use super::decode::WaypointSpace;
use super::screen::Screen;
use crate::cmaes::{CmaEs, CmaOptions, StopReason, StopRules};
use crate::tasks::{PlanError, PlanProgress};
use shared_types::JointTrajectory;
use std::ops::ControlFlow;

/// Size and spread of a search.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchOptions {
    /// Candidates per generation (paper: 60).
    pub population: usize,
    /// Most generations (paper: 25 for striking).
    pub generations: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Deviation of the first generation per coordinate (rad).
    pub std_dev_rad: Vec<f64>,
    /// Draws of one candidate before it is pulled towards the mean.
    pub draws_max: usize,
    /// Error that is good enough to stop (m).
    pub stop_below_m: Option<f64>,
    /// How many of the best candidates are kept.
    pub keep: usize,
}

/// What a task says about one candidate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Valued {
    /// Fitness, smaller is better.
    pub fitness: f64,
    /// Task error (m).
    pub error_m: f64,
    /// When the decisive event occurs (s).
    pub time_s: f64,
}

/// Values one generation of candidates.
pub type Value<'a> = dyn FnMut(&[JointTrajectory]) -> Result<Vec<Valued>, PlanError> + 'a;

/// What a search found.
#[derive(Debug, Clone)]
pub struct SearchResult {
    /// Best candidates, best first, at most `keep`.
    pub best: Vec<(JointTrajectory, Valued)>,
    /// Candidates valued.
    pub simulations: u32,
    /// Candidates drawn again because they broke a limit.
    pub resampled: u32,
}

/// Runs CMA-ES over `space`, from the resting trajectory. `value` sees one
/// generation at a time.
///
/// # Errors
/// Options the strategy refuses, a start pose outside the limits, errors of
/// `value`, or `progress` breaking off.
pub fn search(
    space: &WaypointSpace,
    screen: &Screen,
    bounds: (Vec<f64>, Vec<f64>),
    options: &SearchOptions,
    value: &mut Value<'_>,
    progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
) -> Result<SearchResult, PlanError> {
    let mut strategy = CmaEs::new(CmaOptions {
        mean: space.resting(),
        std_dev: options.std_dev_rad.clone(),
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
    let mut best: Vec<(JointTrajectory, Valued)> = Vec::new();
    let mut simulations = 0;
    let stop = loop {
        let points = strategy.ask(&mut |x| screen.accepts(x))?;
        let trajectories = points
            .iter()
            .map(|x| space.decode(x))
            .collect::<Result<Vec<_>, _>>()?;
        let values = value(&trajectories)?;
        simulations += trajectories.len();
        strategy.tell(&values.iter().map(|v| v.fitness).collect::<Vec<_>>())?;
        best.extend(trajectories.into_iter().zip(values));
        best.sort_by(|a, b| a.1.fitness.total_cmp(&b.1.fitness));
        best.truncate(options.keep.max(1));
        let leader = best[0].1;
        let go_on = progress(PlanProgress {
            generation: strategy.generation(),
            generations: options.generations,
            fitness: leader.fitness,
            error_m: leader.error_m,
            simulations,
        });
        if go_on.is_break() {
            return Err(PlanError::Cancelled {
                generation: strategy.generation(),
            });
        }
        if options.stop_below_m.is_some_and(|e| leader.error_m <= e) {
            break StopReason::FitnessTarget;
        }
        if let Some(reason) = strategy.stop() {
            break reason;
        }
    };
    tracing::debug!(?stop, simulations, "throw search ended");
    Ok(SearchResult {
        best,
        simulations: u32::try_from(simulations).unwrap_or(u32::MAX),
        resampled: u32::try_from(strategy.resampled()).unwrap_or(u32::MAX),
    })
}
