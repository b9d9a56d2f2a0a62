//! `experiments wiggle-ablation`: errors of identified parameters with each of the
//! paper's nine wiggles.
//!
//! The same ropes with the same noise of the films for every wiggle. The network is
//! trained on one wiggle only, so that a fast search proposes the start for all.

use super::ablated_wiggles::{AblatedWiggle, ablated_wiggles};
use super::experiment::{Experiment, Sequence};
use super::picture::Curve;
use crate::args::MethodName;
use arm_model::Pole;
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome};
use experiments::trials::{SysidSummary, Trial, TrialRig, mean, run as trials, summarise};
use planner::ropes::trial_rope;
use rope_sim::PlannedArm;
use serde_json::{Value, json};
use shared_types::rope::RANGES;

/// Ropes identified with each wiggle.
const ROPES: u64 = 24;
/// Wiggles, and columns of the table with that of the names.
const WIGGLES: usize = 9;
const COLUMNS: usize = WIGGLES + 1;

/// Mean over the parameters of a trial's errors as fractions of their ranges (%).
fn mean_error_percent(trial: &Trial) -> f64 {
    let fractions = RANGES.iter().zip(trial.found.iter().zip(&trial.truth));
    100.0
        * mean(
            fractions
                .map(|(range, (found, truth))| (found - truth).abs() / (range.max - range.min)),
        )
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let Experiment {
        args,
        rig,
        options,
        config,
        ..
    } = &experiment;
    if args.method == MethodName::Nn || args.model.is_some() {
        return Err(bad_input!(
            "the network is trained on one wiggle only: use --method hybrid or cmaes, without --model"
        ));
    }
    let figure = |t: &Trial| t.residual_px;
    let requested = experiment.sequence(ROPES, 4, (figure, "ropes, residual px"));
    let ropes = requested.count;
    let wiggles = ablated_wiggles(&config.wiggle).or_failed()?;
    // The network is not taken along: it is trained on one wiggle only.
    let wiggling = |w: &AblatedWiggle| TrialRig {
        motion: PlannedArm::new(w.trajectory, Pole::default()),
        network: None,
        ..rig.clone()
    };
    let rigs: Vec<TrialRig> = wiggles.iter().map(wiggling).collect();
    let sequence = Sequence {
        method: format!("{}, {ropes} ropes", requested.method),
        count: ropes * wiggles.len() as u64,
        ..requested
    };
    // Wiggle by wiggle; a trial's own index is that of the rope.
    let made = experiment.trials(sequence, |batch| {
        let rope = |index| trial_rope(args.seed, index);
        let mut made = Vec::with_capacity(batch.len());
        for one_wiggle in batch.chunk_by(|a, b| a / ropes == b / ropes) {
            let which = usize::try_from(one_wiggle[0] / ropes)?;
            let indices: Vec<u64> = one_wiggle.iter().map(|i| i % ropes).collect();
            made.extend(trials(&rigs[which], rope, &indices, options)?);
        }
        Ok(made)
    })?;
    let Some(all) = made else {
        return experiment.finish_shard();
    };
    let each = usize::try_from(ropes).or_failed()?;
    let summaries: Vec<SysidSummary> = all.chunks(each).map(summarise).collect();
    let curve = |(wiggle, trials): (&AblatedWiggle, &[Trial])| Curve {
        name: wiggle.name.clone(),
        values: trials.iter().map(mean_error_percent).collect(),
        paper: None,
    };
    let curves = wiggles.iter().zip(all.chunks(each)).map(curve).collect();
    let axis = "mean error of the nine parameters, fraction of their ranges (%)";
    let picture = experiment.picture(axis, curves)?;
    let rows: Vec<Value> = wiggles
        .iter()
        .zip(&summaries)
        .map(|(w, s)| json!({"wiggle": w.name, "paper": w.paper, "breaks": w.breaks, "summary": s}))
        .collect();
    let own = json!({ "ropes_each": ropes, "wiggles": rows });
    let summary = format!("{} wiggles, {ropes} ropes each", wiggles.len());
    experiment.finish(&summary, picture, own, || print(&wiggles, &summaries))
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
