//! `experiments robust`: strikes planned for every rope it might be beside strikes
//! planned for the identified one, thrown with the true one, and whether the errors lie
//! where the forecasts had them.

use super::checkpoint::{Sequence, checkpointed_trials};
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use cli_output::Stage;
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome};
use experiments::trials::{Foreseen, RobustTrial, robust_trials};
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
    /// Part of the errors within their 90 % interval.
    covered: f64,
    /// Median width of that interval (m).
    width_m: f64,
}

#[allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index of the list"
)]
fn quantile(mut values: Vec<f64>, part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = (part * values.len().saturating_sub(1) as f64).round() as usize;
    values.get(index).copied().unwrap_or(f64::NAN)
}

fn row(trials: &[RobustTrial], planned: &'static str, of: fn(&RobustTrial) -> Foreseen) -> Row {
    let errors = || trials.iter().map(|t| of(t).strike.error_m).collect();
    let width = |t: &RobustTrial| {
        let [low, high] = of(t).forecast?.interval_90_m;
        Some(high - low)
    };
    #[allow(clippy::cast_precision_loss, reason = "some hundred ropes")]
    let covered =
        trials.iter().filter(|t| of(t).is_covered()).count() as f64 / trials.len().max(1) as f64;
    Row {
        planned,
        median_m: quantile(errors(), 0.5),
        p90_m: quantile(errors(), 0.9),
        max_m: quantile(errors(), 1.0),
        covered,
        width_m: quantile(trials.iter().filter_map(width).collect(), 0.5),
    }
}

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup {
        config,
        rig,
        options,
    } = Setup::new(args)?;
    let method = options.method;
    let stage = Stage::begin("robust", quiet);
    let sequence = Sequence {
        name: "robust",
        method: format!("{method:?}").to_lowercase(),
        count: args.ropes.unwrap_or(ROPES),
        batch: 2 * options.threads.max(1),
        told: (
            |t: &RobustTrial| 100.0 * t.robust.strike.error_m,
            "ropes, cm robust",
        ),
    };
    let trials = checkpointed_trials(&sequence, args, &stage, |batch| {
        robust_trials(&rig, &config, &options, args.seed, batch).or_failed()
    })?;
    let rows = [
        row(&trials, "for the identified rope", |t| t.plain),
        row(&trials, "for sixteen it might be", |t| t.robust),
    ];
    let curve = |row: &Row, of: fn(&RobustTrial) -> Foreseen| Curve {
        name: row.planned.to_owned(),
        values: trials
            .iter()
            .map(|t| 100.0 * of(t).strike.error_m)
            .collect(),
        paper: None,
    };
    let picture = Picture {
        name: "robust",
        axis: "distance of tip and target (cm)",
        seed: args.seed,
        curves: vec![curve(&rows[0], |t| t.plain), curve(&rows[1], |t| t.robust)],
    };
    let picture = picture.write(args.out.as_deref())?;
    let seconds = stage.done(&format!("{} ropes", trials.len()));
    if !quiet {
        print(&rows);
    }
    Ok(Some(json!({
        "ok": true, "command": "robust", "version": shared_types::VERSION,
        "seed": args.seed, "method": method, "ropes": trials.len(), "seconds": seconds,
        "rows": rows, "out": args.out, "picture": picture,
    })))
}

fn print(rows: &[Row]) {
    let cm = |m: f64| format!("{:.2}", 100.0 * m);
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
        "90 %",
        "max",
        "within its 90 % interval",
        "median width of that",
    ];
    println!("{}", numbers(header, 1, lines));
}
