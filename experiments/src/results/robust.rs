//! `experiments robust`: strikes planned for the posterior compared with strikes
//! planned for the identified rope, thrown with the true one, and whether the errors lie
//! within their forecasts.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use cli_output::Outcome;
use cli_output::table::numbers;
use experiments::trials::{Foreseen, RobustTrial, mean, quantile, strike_trials};
use serde::Serialize;
use serde_json::{Value, json};

const ROPES: u64 = 200;

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
    let Experiment {
        config,
        rig,
        options,
        ..
    } = &experiment;
    let figure = |t: &RobustTrial| 100.0 * t.robust.strike.error_m;
    let sequence = experiment.sequence(ROPES, 2, (figure, "ropes, cm robust"));
    let trials = experiment.trials(sequence, |batch| {
        strike_trials(rig, config, options, batch, RobustTrial::of)
    })?;
    let (rows, curves): (Vec<Row>, Vec<Curve>) = [
        row(&trials, "for the identified rope", |t| t.plain),
        row(&trials, "for sixteen it might be", |t| t.robust),
    ]
    .into_iter()
    .unzip();
    let picture = experiment.picture("distance of tip and target (cm)", curves)?;
    let own = json!({ "ropes": trials.len(), "rows": rows });
    let summary = format!("{} ropes", trials.len());
    experiment.finish(&summary, picture, own, || print(&rows))
}

fn print(rows: &[Row]) {
    let lines = rows.iter().map(|row| {
        [
            row.planned.to_owned(),
            cm(row.median_m),
            cm(row.p90_m),
            cm(row.max_m),
            format!("{:.1} %", 100.0 * row.covered),
            cm(row.width_m),
        ]
    });
    let header = [
        "tip-target distance (cm), planned",
        "median",
        "p90",
        "max",
        "within its 90 % interval",
        "median width of that",
    ];
    println!("{}", numbers(header, 1, lines));
}
