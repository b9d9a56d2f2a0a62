//! `experiments sysid`: errors of identified parameters next to the paper's, and
//! whether intervals of 90 % hold the truth that often.

use super::experiment::Experiment;
use super::picture::Curve;
use cli_output::Outcome;
use cli_output::table::numbers;
use experiments::trials::{SysidSummary, Trial, summarise, trial_rope};
use serde_json::{Value, json};
use shared_types::rope::RANGES;

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let seed = experiment.args.seed;
    let trials = experiment.identified(1, |index| trial_rope(seed, index))?;
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
    let rows = summary.parameters.iter().zip(RANGES).map(|(row, range)| {
        [
            row.label.clone(),
            format!("{:.4}", row.mean_error),
            format!("{:.4}", row.median_error),
            format!("{:.4}", row.paper),
            format!("{:.4}", row.middle),
            row.best_possible
                .map_or_else(|| "-".to_owned(), |b| format!("{b:.4}")),
            format!("{:.1}", 100.0 * row.coverage),
            range.unit.to_owned(),
        ]
    });
    let header = [
        "mean absolute error",
        "here",
        "median here",
        "paper's network",
        "middle of range",
        "best possible",
        "90 % interval holds (%)",
        "unit",
    ];
    println!("{}", numbers(header, 1, rows));
    let rows = summary.ratios.iter().map(|row| {
        [
            row.label.clone(),
            format!("{:.2}", 100.0 * row.median),
            format!("{:.2}", 100.0 * row.p90),
        ]
    });
    let header = ["error of ratios", "median (%)", "p90 (%)"];
    println!("\n{}", numbers(header, 0, rows));
    println!(
        "\n{} ropes of the ranges, {:.1} % flagged as out of distribution, residual {:.2} px, {:.0} simulations each",
        summary.trials,
        100.0 * summary.taken_for_outside,
        summary.residual_px,
        summary.simulations
    );
}
