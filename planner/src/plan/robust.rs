//! Throws that are good for every rope it might be.

use super::finalists::Finalist;
use super::setup::{Point, Setup};
use super::trajopt::{SearchOptions, Valued, search};
use super::{PlanError, PlanProgress, PosteriorEnsemble, ThrowOutcome};
use arm_model::JointTrajectory;
use shared_types::{ErrorForecast, RopeParams};
use std::ops::ControlFlow;

/// Fraction of the ropes whose errors a robust plan looks at once more: the worst fifth.
const WORST_FRACTION: f64 = 0.2;
/// Weight of their mean beside the mean of all.
const WORST_WEIGHT: f64 = 3.0;
/// Spread of the first generation, relative to that of the search from scratch.
const SPREAD: f64 = 0.3;
const POPULATION: usize = 16;
const GENERATIONS: usize = 20;

/// Mean, and mean of the worst fifth (conditional value at risk) with its weight.
fn risk(mut values: Vec<f64>) -> f64 {
    values.sort_by(|a, b| b.total_cmp(a));
    let worst = (WORST_FRACTION * values.len() as f64).ceil() as usize;
    let mean = |v: &[f64]| {
        let count = v.len().max(1) as f64;
        v.iter().sum::<f64>() / count
    };
    mean(&values) + WORST_WEIGHT * mean(&values[..worst.min(values.len())])
}

/// Finalists of the plain searches whose risk is compared to choose where to begin.
const COMPARED: usize = 12;

/// The finalist with the least risk over the ropes of the ensemble, and the simulations made.
pub(super) fn least_risk(
    setup: &Setup<'_>,
    ensemble: &PosteriorEnsemble,
    finalists: Vec<Finalist>,
) -> Result<(Option<Finalist>, usize), PlanError> {
    let compared: Vec<Finalist> = finalists.into_iter().take(COMPARED).collect();
    let trajectories: Vec<&JointTrajectory> = compared.iter().map(|f| &f.trajectory).collect();
    let valued = risks(setup, &ensemble.optimised, &trajectories)?;
    let simulations = trajectories.len() * ensemble.optimised.len();
    let best = compared
        .into_iter()
        .zip(valued)
        .min_by(|(_, a), (_, b)| a.fitness.total_cmp(&b.fitness))
        .map(|(finalist, _)| finalist);
    Ok((best, simulations))
}

/// Risk of each throw over the ropes.
fn risks(
    setup: &Setup<'_>,
    ropes: &[RopeParams],
    trajectories: &[&JointTrajectory],
) -> Result<Vec<Valued>, PlanError> {
    let throws: Vec<_> = trajectories
        .iter()
        .flat_map(|t| ropes.iter().map(move |rope| (rope, *t)))
        .collect();
    let outcomes = setup.simulator.run(&throws)?;
    let of_throw = |(t, outcomes): (&&JointTrajectory, &[ThrowOutcome])| {
        let each = |(rope, o): (_, &ThrowOutcome)| setup.fitness(rope, t, o);
        let errors = outcomes.iter().map(|o| setup.task.error_m(o));
        Valued {
            fitness: risk(ropes.iter().zip(outcomes).map(each).collect()),
            error_m: risk(errors.collect()) / (1.0 + WORST_WEIGHT),
            success: false,
        }
    };
    let all = trajectories.iter().zip(outcomes.chunks(ropes.len().max(1)));
    Ok(all.map(of_throw).collect())
}

/// Searches around a finalist for the throw with the least risk over the ropes of the ensemble.
/// Returns the throws found, best first, with the simulations made.
pub(super) fn search_around(
    setup: &Setup<'_>,
    ensemble: &PosteriorEnsemble,
    around: &Finalist,
    progress: &mut dyn FnMut(PlanProgress) -> ControlFlow<()>,
) -> Result<(Vec<Point>, u32), PlanError> {
    let ropes = &ensemble.optimised;
    let options = SearchOptions {
        start: around.x.clone(),
        population: POPULATION,
        generations: GENERATIONS,
        seed: setup.request.options.seed ^ 0x0b57,
        std_dev: setup.std_dev.iter().map(|s| s * SPREAD).collect(),
        draws_max: setup.task.config().draws_max,
        stop_below_m: None,
        stop_success_fraction: None,
        keep: 1,
    };
    let mut value = |trajectories: &[JointTrajectory]| {
        let trajectories: Vec<&JointTrajectory> = trajectories.iter().collect();
        risks(setup, ropes, &trajectories)
    };
    let bounds = setup.bounds.clone();
    let found = search(
        &setup.space,
        &setup.screen,
        bounds,
        &options,
        &mut value,
        progress,
    )?;
    let simulations = found
        .simulations
        .saturating_mul(u32::try_from(ropes.len()).unwrap_or(1));
    let best = found.best.into_iter().map(|f| (f.x, f.trajectory));
    Ok((best.collect(), simulations))
}

/// The error to expect of a throw over the ropes of the forecast.
pub(super) fn forecast(
    setup: &Setup<'_>,
    ensemble: &PosteriorEnsemble,
    trajectory: &JointTrajectory,
) -> Result<Option<ErrorForecast>, PlanError> {
    if ensemble.forecast.is_empty() {
        return Ok(None);
    }
    let throws: Vec<_> = ensemble.forecast.iter().map(|r| (r, trajectory)).collect();
    let outcomes = setup.judging.run(&throws)?;
    let finite = outcomes.iter().filter(|o| o.finite);
    let mut errors: Vec<f64> = finite.map(|o| setup.task.error_m(o)).collect();
    errors.sort_by(f64::total_cmp);
    if errors.is_empty() {
        return Ok(None);
    }
    let at = |part: f64| errors[(part * (errors.len() - 1) as f64).round() as usize];
    let mean_m = errors.iter().sum::<f64>() / errors.len() as f64;
    Ok(Some(ErrorForecast {
        ropes: u32::try_from(errors.len()).unwrap_or(u32::MAX),
        mean_m,
        median_m: at(0.5),
        interval_90_m: [at(0.05), at(0.95)],
    }))
}

#[cfg(test)]
mod tests {
    use super::risk;

    #[test]
    fn the_worst_fifth_counts_four_times_as_much() {
        let values = vec![1.0, 2.0, 3.0, 4.0, 10.0];
        assert!((risk(values) - (4.0 + 3.0 * 10.0)).abs() < 1e-12);
        assert!((risk(vec![2.0]) - 8.0).abs() < 1e-12);
    }
}
