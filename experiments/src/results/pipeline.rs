//! `experiments sim-pipeline`: strikes planned with true, identified and random
//! parameters and thrown with the true rope, beside the paper's table.

use super::checkpoint::{Sequence, checkpointed_trials};
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use cli_output::Stage;
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome};
use experiments::trials::{PipelineTrial, Spread, Strikes, pipeline_trials};
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

/// Errors of one row (cm).
fn curve(trials: &[PipelineTrial], row: &Row, of: fn(&PipelineTrial) -> Strikes) -> Curve {
    Curve {
        name: row.planned_with.to_owned(),
        values: trials.iter().map(|t| 100.0 * of(t).error_m).collect(),
        paper: row.paper_cm.map(|[median, ..]| median),
    }
}

fn row(
    trials: &[PipelineTrial],
    planned_with: &'static str,
    of: fn(&PipelineTrial) -> Strikes,
    paper_cm: Option<[f64; 4]>,
) -> Row {
    let simulations: f64 = trials.iter().map(|t| f64::from(of(t).simulations)).sum();
    #[allow(clippy::cast_precision_loss, reason = "a hundred ropes")]
    let count = trials.len().max(1) as f64;
    Row {
        planned_with,
        error: Spread::of(trials.iter().map(|t| of(t).error_m)),
        simulations: simulations / count,
        paper_cm,
    }
}

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup {
        config,
        rig,
        options,
    } = Setup::new(args)?;
    let method = options.method;
    let stage = Stage::begin("sim-pipeline", quiet);
    let sequence = Sequence {
        name: "sim-pipeline",
        method: format!("{method:?}").to_lowercase(),
        count: args.ropes.unwrap_or(ROPES),
        batch: 2 * options.threads.max(1),
        told: (
            |t: &PipelineTrial| 100.0 * t.identified.error_m,
            "ropes, cm identified",
        ),
    };
    let trials = checkpointed_trials(&sequence, args, &stage, |batch| {
        pipeline_trials(&rig, &config, &options, args.seed, batch).or_failed()
    })?;
    let rows = [
        row(
            &trials,
            "true parameters, 60 x 25",
            |t| t.true_rope,
            Some([1.2, 0.25, 21.6, 1.4]),
        ),
        row(
            &trials,
            "true parameters, 3 s",
            |t| t.true_rope_longer,
            None,
        ),
        row(
            &trials,
            "identified parameters",
            |t| t.identified,
            Some([2.1, 0.27, 70.2, 5.7]),
        ),
        row(
            &trials,
            "another rope's parameters",
            |t| t.random,
            Some([12.8, 0.14, 104.3, 16.3]),
        ),
    ];
    let picture = Picture {
        name: "sim-pipeline",
        axis: "distance of tip and target (cm); dashed: the paper's median",
        seed: args.seed,
        curves: vec![
            curve(&trials, &rows[0], |t| t.true_rope),
            curve(&trials, &rows[1], |t| t.true_rope_longer),
            curve(&trials, &rows[2], |t| t.identified),
            curve(&trials, &rows[3], |t| t.random),
        ],
    };
    let picture = picture.write(args.out.as_deref())?;
    let seconds = stage.done(&format!("{} ropes", trials.len()));
    if !quiet {
        print(&rows);
    }
    Ok(Some(json!({
        "ok": true, "command": "sim-pipeline", "version": shared_types::VERSION,
        "seed": args.seed, "method": method, "ropes": trials.len(), "seconds": seconds,
        "rows": rows, "out": args.out, "picture": picture,
    })))
}

fn print(rows: &[Row]) {
    let cm = |m: f64| format!("{:.2}", 100.0 * m);
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
        "99 %",
        "mean",
        "simulations",
        "paper: median / min / max / mean",
    ];
    println!("{}", numbers(header, 1, lines));
}
