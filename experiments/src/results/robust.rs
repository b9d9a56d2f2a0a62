//! `experiments robust`: strikes planned for the posterior compared with strikes
//! planned for the identified rope, thrown with the true one, and whether the errors lie
//! within their forecasts.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use super::strikes::{StrikeCase, Strikes, strike_trials};
use crate::report::Column;
use cli_output::Outcome;
use experiments::trials::{mean, quantile};
use planner::plan::{PlanError, PosteriorEnsemble};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shared_types::ErrorForecast;

const ROPES: u64 = 200;
/// Ropes that a robust plan is optimised over, and that a forecast is made with.
const OPTIMISED: usize = 16;
const FORECAST: usize = 64;
/// Searches of a plan.
const SEARCHES: usize = 3;

/// One strike and what was to be expected of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Foreseen {
    /// What it did.
    strike: Strikes,
    /// What the posterior of the rope let expect.
    forecast: Option<ErrorForecast>,
}

impl Foreseen {
    /// Whether the error lies within its forecast interval.
    fn is_covered(&self) -> bool {
        self.forecast.is_some_and(|f| {
            let [low, high] = f.interval_90_m;
            (low..=high).contains(&self.strike.error_m)
        })
    }
}

/// One rope and target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct RobustTrial {
    index: u64,
    target_m: [f64; 3],
    /// Planned with the identified parameters.
    plain: Foreseen,
    /// Planned with sixteen ropes of the posterior.
    robust: Foreseen,
}

impl RobustTrial {
    fn of(case: &StrikeCase) -> Result<Self, PlanError> {
        let (thrower, found) = (&case.thrower, &case.found);
        let foreseen = |optimised: usize| -> Result<Foreseen, PlanError> {
            let seed = thrower.options.seed;
            let drawn = PosteriorEnsemble::drawn(
                &found.params,
                &found.posterior,
                optimised,
                FORECAST,
                seed,
            );
            // These ropes are thrown in the very model that they are planned with, by an arm
            // whose joints have no errors.
            let drawn = PosteriorEnsemble {
                discrepancy_m: 0.0,
                joint_zero_std_rad: 0.0,
                ..drawn
            };
            let planned = thrower.plan_for(&found.params, SEARCHES, drawn)?;
            Ok(Foreseen {
                strike: thrower.throw(&planned)?,
                forecast: planned.forecast,
            })
        };
        Ok(Self {
            index: case.index,
            target_m: case.target_m,
            plain: foreseen(0)?,
            robust: foreseen(OPTIMISED)?,
        })
    }
}

/// One way of planning.
#[derive(Debug, Serialize)]
struct Row {
    planned: &'static str,
    median_m: f64,
    p90_m: f64,
    max_m: f64,
    /// Fraction of the errors within their 90 % interval.
    covered: f64,
    /// Median width of that interval (m).
    width_m: f64,
}

const TABLE: [Column<Row>; 6] = [
    ("tip-target distance (cm), planned", |row| {
        row.planned.to_owned()
    }),
    ("median", |row| cm(row.median_m)),
    ("p90", |row| cm(row.p90_m)),
    ("max", |row| cm(row.max_m)),
    ("within its 90 % interval", |row| {
        format!("{:.1} %", 100.0 * row.covered)
    }),
    ("median width of that", |row| cm(row.width_m)),
];

/// A way of planning, with its errors as a curve.
fn row(
    trials: &[RobustTrial],
    planned: &'static str,
    of: fn(&RobustTrial) -> Foreseen,
) -> (Row, Curve) {
    let errors_m = || trials.iter().map(|t| of(t).strike.error_m);
    let width_m = |t: &RobustTrial| {
        let [low, high] = of(t).forecast?.interval_90_m;
        Some(high - low)
    };
    let covered = |t: &RobustTrial| f64::from(u8::from(of(t).is_covered()));
    let row = Row {
        planned,
        median_m: quantile(errors_m(), 0.5),
        p90_m: quantile(errors_m(), 0.9),
        max_m: quantile(errors_m(), 1.0),
        covered: mean(trials.iter().map(covered)),
        width_m: quantile(trials.iter().filter_map(width_m), 0.5),
    };
    (row, Curve::cm(planned, errors_m(), None))
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let figure = |t: &RobustTrial| 100.0 * t.robust.strike.error_m;
    let sequence = experiment.sequence(ROPES, 2, (figure, "ropes, cm robust"));
    let made = strike_trials(&experiment, sequence, RobustTrial::of)?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let rows = [
        row(&trials, "for the identified rope", |t| t.plain),
        row(&trials, "for sixteen it might be", |t| t.robust),
    ];
    let axis = "distance of tip and target (cm)";
    experiment.finish_rows(trials.len(), rows.into_iter().unzip(), axis, TABLE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_covered_within_its_interval_only() {
        let of = |error_m: f64| Foreseen {
            strike: Strikes {
                error_m,
                predicted_m: 0.0,
                simulations: 1,
            },
            forecast: Some(ErrorForecast {
                ropes: 64,
                failed: 0,
                mean_m: 0.01,
                median_m: 0.01,
                interval_90_m: [0.002, 0.02],
            }),
        };
        assert!(of(0.002).is_covered() && of(0.02).is_covered());
        assert!(!of(0.0019).is_covered() && !of(0.021).is_covered());
        let blind = Foreseen {
            forecast: None,
            ..of(0.01)
        };
        assert!(!blind.is_covered());
    }
}
