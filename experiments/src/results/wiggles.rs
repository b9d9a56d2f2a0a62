//! `experiments wiggle-ablation`: errors of identified parameters with each of the
//! paper's nine wiggles.
//!
//! The same ropes with the same noise of the films for every wiggle. The network knows
//! one wiggle only, so that a fast search proposes the start for all.

use super::checkpoint::{Sequence, checkpointed_trials};
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::{MethodName, ResultArgs};
use anyhow::anyhow;
use cli_output::Stage;
use cli_output::table::numbers;
use cli_output::{Failure, OrInput, Outcome};
use experiments::trials::{
    AblatedWiggle, SysidSummary, Trial, TrialRig, ablated_wiggles, run as trials, summarise,
    trial_rope,
};
use serde_json::{Value, json};
use shared_types::rope::RANGES;

/// Ropes identified with each wiggle.
const ROPES: u64 = 24;
/// Trials made between two writes of the file, by each thread.
const EACH: usize = 4;
/// Wiggles, and columns of the table with that of the names.
const WIGGLES: usize = 9;
const COLUMNS: usize = WIGGLES + 1;

/// Mean over the parameters of a trial's errors, part of their ranges (%).
#[allow(clippy::cast_precision_loss, reason = "nine parameters")]
fn mean_error_percent(trial: &Trial) -> f64 {
    let parts = RANGES.iter().zip(trial.found.iter().zip(&trial.truth));
    let sum: f64 = parts
        .map(|(range, (found, truth))| (found - truth).abs() / (range.max - range.min))
        .sum();
    100.0 * sum / RANGES.len() as f64
}

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    if args.method == MethodName::Nn || args.model.is_some() {
        return Err(Failure::input(anyhow!(
            "a network knows one wiggle only: use --method hybrid or cmaes, without --model"
        )));
    }
    let ropes = args.ropes.unwrap_or(ROPES);
    if ropes == 0 {
        return Err(Failure::input(anyhow!(
            "--ropes is 0, but must be 1 or more"
        )));
    }
    let Setup {
        rig,
        options,
        config,
    } = Setup::new(args)?;
    let wiggles = ablated_wiggles(&config.wiggle).or_failed()?;
    let rigs: Vec<TrialRig> = wiggles.iter().map(|w| rig.wiggling(w)).collect();
    let stage = Stage::begin("wiggle-ablation", quiet);
    let sequence = Sequence {
        name: "wiggle-ablation",
        method: format!("{:?}, {ropes} ropes", options.method).to_lowercase(),
        count: ropes * wiggles.len() as u64,
        batch: EACH * options.threads.max(1),
        told: (|t: &Trial| t.residual_px, "ropes, residual px"),
    };
    // Wiggle by wiggle; a trial's own index is that of the rope.
    let all = checkpointed_trials(&sequence, args, &stage, |batch| {
        let rope = |index| trial_rope(args.seed, index);
        let mut made = Vec::with_capacity(batch.len());
        for part in batch.chunk_by(|a, b| a / ropes == b / ropes) {
            let which = usize::try_from(part[0] / ropes).or_failed()?;
            let indices: Vec<u64> = part.iter().map(|i| i % ropes).collect();
            made.extend(trials(&rigs[which], rope, args.seed, &indices, &options).or_failed()?);
        }
        Ok(made)
    })?;
    let each = usize::try_from(ropes).or_failed()?;
    let summaries: Vec<SysidSummary> = all.chunks(each).map(summarise).collect();
    let seconds = stage.done(&format!("{} wiggles, {ropes} ropes each", wiggles.len()));
    if !quiet {
        print(&wiggles, &summaries);
    }
    let curve = |(wiggle, trials): (&AblatedWiggle, &[Trial])| Curve {
        name: wiggle.name.clone(),
        values: trials.iter().map(mean_error_percent).collect(),
        paper: None,
    };
    let picture = Picture {
        name: "wiggle-ablation",
        axis: "mean error of the nine parameters, part of their ranges (%)",
        seed: args.seed,
        curves: wiggles.iter().zip(all.chunks(each)).map(curve).collect(),
    };
    let picture = picture.write(args.out.as_deref())?;
    let rows: Vec<Value> = wiggles
        .iter()
        .zip(&summaries)
        .map(|(w, s)| json!({"wiggle": w.name, "paper": w.paper, "breaks": w.breaks, "summary": s}))
        .collect();
    Ok(Some(json!({
        "ok": true, "command": "wiggle-ablation", "version": shared_types::VERSION,
        "seed": args.seed, "method": options.method, "ropes_each": ropes, "seconds": seconds,
        "out": args.out, "picture": picture, "wiggles": rows,
    })))
}

fn print(wiggles: &[AblatedWiggle], summaries: &[SysidSummary]) {
    let mut header = ["mean absolute error: here (paper)"; COLUMNS];
    for (cell, wiggle) in header[1..].iter_mut().zip(wiggles) {
        *cell = &wiggle.name;
    }
    let row = |label: String, cell: &dyn Fn(usize) -> String| -> [String; COLUMNS] {
        let mut label = Some(label);
        core::array::from_fn(|i| label.take().unwrap_or_else(|| cell(i - 1)))
    };
    let errors = RANGES.iter().enumerate().map(|(i, range)| {
        let label = format!("{} {}", range.label, range.unit);
        row(label, &|w| {
            let here = summaries[w].parameters[i].mean_error;
            format!("{here:.4} ({})", wiggles[w].paper[i])
        })
    });
    let ratios = summaries.first().map_or(0, |s| s.ratios.len());
    let medians = (0..ratios).map(|i| {
        let label = format!("{}, median (%)", summaries[0].ratios[i].label);
        row(label, &|w| {
            format!("{:.2}", 100.0 * summaries[w].ratios[i].median)
        })
    });
    println!("{}", numbers(header, 1, errors.chain(medians)));
    for wiggle in wiggles {
        if let Some(what) = &wiggle.breaks {
            println!("{}: no arm may execute it: {what}", wiggle.name);
        }
    }
}
