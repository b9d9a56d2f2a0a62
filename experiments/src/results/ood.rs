//! `experiments sysid-ood`: are ropes outside the parameter ranges noticed?
//!
//! As many ropes like chains and beyond the ranges as ropes inside, all with the
//! paper's noise.

use super::ROPES;
use super::checkpoint::trials;
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use cli_output::Outcome;
use cli_output::Stage;
use experiments::trials::{Trial, area_under_curve, outside_rope, trial_rope};
use serde_json::{Value, json};

/// Part of some trials taken for ropes outside.
#[allow(clippy::cast_precision_loss, reason = "counts are small")]
fn taken_for_outside(trials: &[Trial]) -> f64 {
    trials.iter().filter(|t| t.outside).count() as f64 / trials.len().max(1) as f64
}

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup { rig, options, .. } = Setup::new(args)?;
    let stage = Stage::begin("sysid-ood", quiet);
    // Even indices are inside, odd ones outside.
    let rope = |index: u64| {
        if index.is_multiple_of(2) {
            trial_rope(args.seed, index / 2)
        } else {
            outside_rope(args.seed, index / 2)
        }
    };
    let all = trials(
        "sysid-ood",
        args,
        2 * args.ropes.unwrap_or(ROPES),
        &rig,
        &options,
        rope,
        &stage,
    )?;
    let (inside, outside): (Vec<Trial>, Vec<Trial>) =
        all.into_iter().partition(|t| t.index.is_multiple_of(2));
    let scores = |trials: &[Trial]| trials.iter().map(|t| t.novelty).collect::<Vec<f64>>();
    let area = area_under_curve(&scores(&outside), &scores(&inside));
    let curve = |name: &str, values| Curve {
        name: name.to_owned(),
        values,
        paper: None,
    };
    let picture = Picture {
        name: "sysid-ood",
        axis: "score of the novelty",
        seed: args.seed,
        curves: vec![
            curve("ropes of the ranges", scores(&inside)),
            curve("chains and ropes beyond the ranges", scores(&outside)),
        ],
    };
    let picture = picture.write(args.out.as_deref())?;
    let (found, false_alarms) = (taken_for_outside(&outside), taken_for_outside(&inside));
    let seconds = stage.done(&format!("{} ropes", inside.len() + outside.len()));
    if !quiet {
        println!(
            "{} ropes inside, {} outside: area under the curve {area:.3}, {:.1} % found, {:.1} % false alarms",
            inside.len(),
            outside.len(),
            100.0 * found,
            100.0 * false_alarms
        );
    }
    Ok(Some(json!({
        "ok": true, "command": "sysid-ood", "version": shared_types::VERSION,
        "seed": args.seed, "method": options.method, "ropes_inside": inside.len(),
        "ropes_outside": outside.len(), "area_under_curve": area, "found": found,
        "false_alarms": false_alarms, "seconds": seconds, "out": args.out, "picture": picture,
    })))
}
