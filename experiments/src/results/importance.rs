//! `experiments parameter-importance`: strikes planned with some parameters identified
//! and the others random, beside the paper's table.

use super::checkpoint::{Sequence, checkpointed_trials};
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use cli_output::Stage;
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome};
use experiments::trials::{ImportanceTrial, Spread, importance_trials};
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
        let curve = Curve {
            name: identified.to_owned(),
            values: errors_m.iter().map(|e| 100.0 * e).collect(),
            paper: Some(paper_cm[0]),
        };
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

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup {
        config,
        rig,
        options,
    } = Setup::new(args)?;
    let method = options.method;
    let stage = Stage::begin("parameter-importance", quiet);
    let sequence = Sequence {
        name: "parameter-importance",
        method: format!("{method:?}").to_lowercase(),
        count: args.ropes.unwrap_or(ROPES),
        batch: options.threads.max(1),
        told: (
            |t: &ImportanceTrial| 100.0 * t.identified_m,
            "ropes, cm identified",
        ),
    };
    let trials = checkpointed_trials(&sequence, args, &stage, |batch| {
        importance_trials(&rig, &config, &options, args.seed, batch).or_failed()
    })?;
    let (rows, curves): (Vec<Row>, Vec<Curve>) = rows(&trials).into_iter().unzip();
    let picture = Picture {
        name: "parameter-importance",
        axis: "distance of tip and target (cm); dashed: the paper's mean",
        seed: args.seed,
        curves,
    };
    let picture = picture.write(args.out.as_deref())?;
    let seconds = stage.done(&format!("{} ropes", trials.len()));
    if !quiet {
        print(&rows);
    }
    Ok(Some(json!({
        "ok": true, "command": "parameter-importance",
        "version": shared_types::VERSION, "seed": args.seed, "method": method,
        "ropes": trials.len(), "seconds": seconds, "rows": rows, "out": args.out, "picture": picture,
    })))
}

fn print(rows: &[Row]) {
    let cm = |m: f64| format!("{:.2}", 100.0 * m);
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
