//! `experiments sysid`: errors of identified parameters next to the paper's, and
//! whether intervals of 90 % hold the truth that often.

use super::experiment::Experiment;
use super::picture::Curve;
use crate::report::{Column, print_table};
use cli_output::Outcome;
use experiments::trials::{ParameterRow, RatioRow, SysidSummary, Trial, summarise};
use planner::ropes::trial_rope;
use serde_json::{Value, json};
use shared_types::rope::{ParameterRange, RANGES};

const PARAMETERS: [Column<(ParameterRow, ParameterRange)>; 8] = [
    ("mean absolute error", |(row, _)| row.label.clone()),
    ("here", |(row, _)| format!("{:.4}", row.mean_error)),
    ("median here", |(row, _)| format!("{:.4}", row.median_error)),
    ("paper's network", |(row, _)| format!("{:.4}", row.paper)),
    ("middle of range", |(row, _)| format!("{:.4}", row.middle)),
    ("best possible", |(row, _)| {
        let best = row.best_possible.map(|b| format!("{b:.4}"));
        best.unwrap_or_else(|| "-".to_owned())
    }),
    ("90 % interval holds (%)", |(row, _)| {
        format!("{:.1}", 100.0 * row.coverage)
    }),
    ("unit", |(_, range)| range.unit.to_owned()),
];

const RATIOS: [Column<RatioRow>; 3] = [
    ("error of ratios", |row| row.label.clone()),
    ("median (%)", |row| format!("{:.2}", 100.0 * row.median)),
    ("p90 (%)", |row| format!("{:.2}", 100.0 * row.p90)),
];

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let seed = experiment.args.seed;
    let made = experiment.identified(1, |index| trial_rope(seed, index))?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let summary = summarise(&trials);
    let curves = summary.parameters.iter().zip(RANGES).enumerate();
    let curves = curves.map(|(at, (row, range))| {
        let percent = 100.0 / (range.max - range.min);
        let error = |t: &Trial| percent * (t.found[at] - t.truth[at]).abs();
        Curve {
            name: row.label.clone(),
            values: trials.iter().map(error).collect(),
            paper: Some(percent * row.paper),
        }
    });
    let axis = "absolute error, fraction of the parameter's range (%); dashed: the paper's mean";
    let picture = experiment.picture(axis, curves.collect())?;
    let own = json!({ "ropes": trials.len(), "summary": summary });
    let ropes = format!("{} ropes", trials.len());
    experiment.finish(&ropes, picture, own, || print(&summary))
}

fn print(summary: &SysidSummary) {
    let parameters: Vec<(ParameterRow, ParameterRange)> =
        summary.parameters.iter().cloned().zip(RANGES).collect();
    print_table(&parameters, 1, PARAMETERS);
    println!();
    print_table(&summary.ratios, 0, RATIOS);
    println!(
        "\n{} ropes of the ranges, {:.1} % flagged as out of distribution, residual {:.2} px, {:.0} simulations each",
        summary.trials,
        100.0 * summary.flagged_fraction,
        summary.residual_px,
        summary.simulations
    );
}
