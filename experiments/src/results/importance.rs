//! `experiments parameter-importance`: strikes planned with some parameters identified
//! and the others random, next to the paper's table.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use cli_output::Outcome;
use cli_output::table::numbers;
use experiments::trials::{ImportanceTrial, Spread, strike_trials};
use serde::Serialize;
use serde_json::{Value, json};

/// Ropes of the paper's table.
const ROPES: u64 = 30;

/// One condition, with mean and standard deviation of the paper (cm).
#[derive(Debug, Serialize)]
struct Row {
    identified: &'static str,
    error: Spread,
    throws: usize,
    paper_cm: [f64; 2],
}

/// The conditions, with their errors (cm) as curves.
fn rows(trials: &[ImportanceTrial]) -> Vec<(Row, Curve)> {
    let row = |identified: &'static str, errors_m: Vec<f64>, paper_cm: [f64; 2]| {
        let curve = Curve::cm(identified, errors_m.iter().copied(), Some(paper_cm[0]));
        let row = Row {
            identified,
            throws: errors_m.len(),
            error: Spread::of(errors_m),
            paper_cm,
        };
        (row, curve)
    };
    let partly = |condition: usize| {
        let of = |t: &ImportanceTrial| t.partly_m.get(condition).cloned().unwrap_or_default();
        trials.iter().flat_map(of).collect()
    };
    let all = trials.iter().map(|t| t.identified_m).collect();
    vec![
        row("all", all, [0.9, 0.4]),
        row("length and lead mass", partly(0), [10.9, 10.1]),
        row("length", partly(1), [13.3, 13.5]),
        row("lead mass", partly(2), [12.3, 10.5]),
        row("none", partly(3), [14.2, 12.5]),
    ]
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let Experiment {
        config,
        rig,
        options,
        ..
    } = &experiment;
    let figure = |t: &ImportanceTrial| 100.0 * t.identified_m;
    let sequence = experiment.sequence(ROPES, 1, (figure, "ropes, cm identified"));
    let trials = experiment.trials(sequence, |batch| {
        strike_trials(rig, config, options, batch, ImportanceTrial::of)
    })?;
    let (rows, curves): (Vec<Row>, Vec<Curve>) = rows(&trials).into_iter().unzip();
    let axis = "distance of tip and target (cm); dashed: the paper's mean";
    let picture = experiment.picture(axis, curves)?;
    let own = json!({ "ropes": trials.len(), "rows": rows });
    let summary = format!("{} ropes", trials.len());
    experiment.finish(&summary, picture, own, || print(&rows))
}

fn print(rows: &[Row]) {
    let lines = rows.iter().map(|row| {
        let [mean, std] = row.paper_cm;
        [
            row.identified.to_owned(),
            cm(row.error.mean_m),
            cm(row.error.std_m),
            cm(row.error.median_m),
            row.throws.to_string(),
            format!("{mean} ± {std}"),
        ]
    });
    let header = [
        "identified, the rest random",
        "mean (cm)",
        "std (cm)",
        "median (cm)",
        "throws",
        "paper (cm)",
    ];
    println!("{}", numbers(header, 1, lines));
}
