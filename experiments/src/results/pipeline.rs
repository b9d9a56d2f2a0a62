//! `experiments sim-pipeline`: strikes planned with true, identified and random
//! parameters and thrown with the true rope, next to the paper's table.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use super::strikes::{StrikeCase, Strikes, strike_trials};
use crate::report::Column;
use cli_output::Outcome;
use experiments::trials::{Spread, mean};
use planner::plan::PlanError;
use planner::ropes::trial_rope;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use shared_types::rope::ROPE_PARAMETERS;

/// Ropes of the paper's table.
const ROPES: u64 = 100;
/// Keeps the ropes planned for at random apart from those thrown.
const OTHER: u64 = 0x0074_6865_7200;
/// Searches of the longer budget; three of the paper's size take about three seconds on
/// two cores.
const SEARCHES: usize = 3;

/// One rope and target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PipelineTrial {
    index: u64,
    target_m: [f64; 3],
    truth: [f64; ROPE_PARAMETERS],
    found: [f64; ROPE_PARAMETERS],
    /// Planned with the truth in one search of the paper's size.
    true_rope: Strikes,
    /// Planned with the truth in up to three such searches.
    true_rope_longer: Strikes,
    /// Planned with the identified parameters.
    identified: Strikes,
    /// Planned for another rope of the ranges.
    random: Strikes,
}

impl PipelineTrial {
    fn of(case: &StrikeCase) -> Result<Self, PlanError> {
        let (thrower, found) = (&case.thrower, case.found.params);
        let truth = thrower.truth;
        let once = thrower.plan(&truth, 1)?;
        let true_rope = thrower.throw(&once)?;
        // A further search begins only where the first was not good enough.
        let true_rope_longer = if once.predicted_error_m <= thrower.options.good_enough_m {
            true_rope
        } else {
            thrower.throw(&thrower.plan(&truth, SEARCHES)?)?
        };
        let other = trial_rope(case.seed ^ OTHER, case.index);
        Ok(Self {
            index: case.index,
            target_m: case.target_m,
            truth: truth.to_array(),
            found: found.to_array(),
            true_rope,
            true_rope_longer,
            identified: thrower.throw(&thrower.plan(&found, SEARCHES)?)?,
            random: thrower.throw(&thrower.plan(&other, 1)?)?,
        })
    }
}

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

const TABLE: [Column<Row>; 8] = [
    ("tip-target distance (cm), planned with", |row| {
        row.planned_with.to_owned()
    }),
    ("median", |row| cm(row.error.median_m)),
    ("min", |row| cm(row.error.min_m)),
    ("max", |row| cm(row.error.max_m)),
    ("p99", |row| cm(row.error.p99_m)),
    ("mean", |row| {
        format!("{} ± {}", cm(row.error.mean_m), cm(row.error.std_m))
    }),
    ("simulations", |row| format!("{:.0}", row.simulations)),
    ("paper: median / min / max / mean", |row| {
        let paper = row.paper_cm.map(|cm| cm.map(|number| number.to_string()));
        paper.map_or_else(String::new, |numbers| numbers.join(" / "))
    }),
];

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
    (
        "true parameters, up to three searches",
        |t| t.true_rope_longer,
        None,
    ),
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
    let figure = |t: &PipelineTrial| 100.0 * t.identified.error_m;
    let sequence = experiment.sequence(ROPES, 2, (figure, "ropes, cm identified"));
    let made = strike_trials(&experiment, sequence, PipelineTrial::of)?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let axis = "distance of tip and target (cm); dashed: the paper's median";
    experiment.finish_rows(trials.len(), rows(&trials), axis, TABLE)
}
