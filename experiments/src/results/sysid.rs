//! `experiments sysid`: errors of identified parameters beside the paper's, and
//! whether intervals of 90 % hold the truth that often.

use super::ROPES;
use super::checkpoint::trials;
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use cli_output::Outcome;
use cli_output::Stage;
use cli_output::table::numbers;
use experiments::trials::{SysidSummary, summarise, trial_rope};
use serde_json::{Value, json};
use shared_types::rope::RANGES;

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup { rig, options, .. } = Setup::new(args)?;
    let stage = Stage::begin("sysid", quiet);
    let rope = |index| trial_rope(args.seed, index);
    let all = trials(
        "sysid",
        args,
        args.ropes.unwrap_or(ROPES),
        &rig,
        &options,
        rope,
        &stage,
    )?;
    let summary = summarise(&all);
    let curves = summary.parameters.iter().zip(RANGES).enumerate();
    let picture = Picture {
        name: "sysid",
        axis: "absolute error, part of the parameter's range (%); dashed: the paper's mean",
        seed: args.seed,
        curves: curves
            .map(|(at, (row, range))| {
                let part = 100.0 / (range.max - range.min);
                Curve {
                    name: row.label.clone(),
                    values: all
                        .iter()
                        .map(|t| part * (t.found[at] - t.truth[at]).abs())
                        .collect(),
                    paper: Some(part * row.paper),
                }
            })
            .collect(),
    };
    let picture = picture.write(args.out.as_deref())?;
    let seconds = stage.done(&format!("{} ropes", all.len()));
    if !quiet {
        print(&summary);
    }
    Ok(Some(json!({
        "ok": true, "command": "sysid", "version": shared_types::VERSION,
        "seed": args.seed, "method": options.method, "ropes": all.len(), "seconds": seconds,
        "out": args.out, "picture": picture, "summary": summary,
    })))
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
    let header = ["error of ratios", "median (%)", "nine tenths below (%)"];
    println!("\n{}", numbers(header, 0, rows));
    println!(
        "\n{} ropes of the ranges, {:.1} % taken for ropes outside, residual {:.2} px, {:.0} simulations each",
        summary.trials,
        100.0 * summary.taken_for_outside,
        summary.residual_px,
        summary.simulations
    );
}
