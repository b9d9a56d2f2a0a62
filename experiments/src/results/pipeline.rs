//! `experiments sim-pipeline`: strikes planned with true, identified and random
//! parameters and thrown with the true rope, next to the paper's table.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use cli_output::Outcome;
use cli_output::table::numbers;
use experiments::trials::{PipelineTrial, Spread, Strikes, mean, strike_trials};
use serde::Serialize;
use serde_json::{Value, json};

/// Ropes of the paper's table.
const ROPES: u64 = 100;

/// One row: what was planned with, and what the paper has for it.
#[derive(Debug, Serialize)]
struct Row {
    planned_with: &'static str,
    error: Spread,
    /// Mean number of throws simulated.
    simulations: f64,
    /// Median, smallest, greatest and mean of the paper (cm).
    paper_cm: Option<[f64; 4]>,
}

type Condition = (
    &'static str,
    fn(&PipelineTrial) -> Strikes,
    Option<[f64; 4]>,
);

/// What is planned with, and the paper's errors.
const CONDITIONS: [Condition; 4] = [
    (
        "true parameters, 60 x 25",
        |t| t.true_rope,
        Some([1.2, 0.25, 21.6, 1.4]),
    ),
    ("true parameters, 3 s", |t| t.true_rope_longer, None),
    (
        "identified parameters",
        |t| t.identified,
        Some([2.1, 0.27, 70.2, 5.7]),
    ),
    (
        "another rope's parameters",
        |t| t.random,
        Some([12.8, 0.14, 104.3, 16.3]),
    ),
];

/// The conditions, with their errors as curves.
fn rows(trials: &[PipelineTrial]) -> (Vec<Row>, Vec<Curve>) {
    let row = |(planned_with, of, paper_cm): Condition| {
        let errors_m = || trials.iter().map(|t| of(t).error_m);
        let row = Row {
            planned_with,
            error: Spread::of(errors_m()),
            simulations: mean(trials.iter().map(|t| f64::from(of(t).simulations))),
            paper_cm,
        };
        let median_cm = paper_cm.map(|[median, ..]| median);
        (row, Curve::cm(planned_with, errors_m(), median_cm))
    };
    CONDITIONS.into_iter().map(row).unzip()
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let Experiment {
        config,
        rig,
        options,
        ..
    } = &experiment;
    let figure = |t: &PipelineTrial| 100.0 * t.identified.error_m;
    let sequence = experiment.sequence(ROPES, 2, (figure, "ropes, cm identified"));
    let trials = experiment.trials(sequence, |batch| {
        strike_trials(rig, config, options, batch, PipelineTrial::of)
    })?;
    let (rows, curves) = rows(&trials);
    let axis = "distance of tip and target (cm); dashed: the paper's median";
    let picture = experiment.picture(axis, curves)?;
    let own = json!({ "ropes": trials.len(), "rows": rows });
    let summary = format!("{} ropes", trials.len());
    experiment.finish(&summary, picture, own, || print(&rows))
}

fn print(rows: &[Row]) {
    let lines = rows.iter().map(|row| {
        let e = row.error;
        [
            row.planned_with.to_owned(),
            cm(e.median_m),
            cm(e.min_m),
            cm(e.max_m),
            cm(e.p99_m),
            format!("{} ± {}", cm(e.mean_m), cm(e.std_m)),
            format!("{:.0}", row.simulations),
            row.paper_cm.map_or_else(String::new, |p| {
                format!("{} / {} / {} / {}", p[0], p[1], p[2], p[3])
            }),
        ]
    });
    let header = [
        "tip-target distance (cm), planned with",
        "median",
        "min",
        "max",
        "p99",
        "mean",
        "simulations",
        "paper: median / min / max / mean",
    ];
    println!("{}", numbers(header, 1, lines));
}
