//! When a search ends.

use super::CmaEs;

/// Rules that end a search; the first that applies does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopRules {
    /// Most generations.
    pub generations_max: usize,
    /// Fitness that is good enough.
    pub fitness_target: f64,
    /// Largest deviation of any coordinate, as a part of its deviation at the
    /// start, below which the search has converged.
    pub step_tolerance: f64,
    /// Change of the best fitness over the last generations, and spread of the
    /// better half of the last one, below which the search has converged.
    pub fitness_tolerance: f64,
    /// Largest ratio of the covariance's eigenvalues.
    pub condition_max: f64,
}

impl Default for StopRules {
    fn default() -> Self {
        Self {
            generations_max: 10_000,
            fitness_target: f64::NEG_INFINITY,
            step_tolerance: 1e-11,
            fitness_tolerance: 1e-12,
            condition_max: 1e14,
        }
    }
}

/// Why a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The budget of generations is used up.
    Generations,
    /// The fitness target is reached.
    FitnessTarget,
    /// The distribution has shrunk below the tolerance.
    StepTolerance,
    /// The fitness no longer changes.
    FitnessTolerance,
    /// The covariance is numerically degenerate.
    Condition,
}

impl StopRules {
    pub(super) fn check(&self, search: &CmaEs) -> Option<StopReason> {
        let best = search.best.as_ref()?;
        if best.fitness <= self.fitness_target {
            return Some(StopReason::FitnessTarget);
        }
        if search.generation >= self.generations_max {
            return Some(StopReason::Generations);
        }
        let deviation = search.sigma * search.covariance.diagonal().max().sqrt();
        if deviation < self.step_tolerance {
            return Some(StopReason::StepTolerance);
        }
        let window = 10 + 30 * search.mean.len() / search.options.population;
        let history = &search.best_of_generations;
        if history.len() >= window {
            let last = history[history.len() - window..].iter().copied();
            let low = last.clone().fold(f64::INFINITY, f64::min);
            let high = last.fold(f64::NEG_INFINITY, f64::max);
            if (high - low).max(search.last_spread) < self.fitness_tolerance {
                return Some(StopReason::FitnessTolerance);
            }
        }
        let (long, short) = (search.axis_lengths.max(), search.axis_lengths.min());
        ((long / short).powi(2) > self.condition_max).then_some(StopReason::Condition)
    }
}
