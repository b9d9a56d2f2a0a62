//! `experiments sysid-ood`: are ropes outside the parameter ranges noticed?
//!
//! As many ropes like chains and beyond the ranges as ropes inside, all with the
//! paper's noise.

use super::experiment::Experiment;
use super::picture::Curve;
use cli_output::Outcome;
use experiments::trials::{Trial, area_under_curve, mean};
use planner::ropes::{OUTSIDE_KINDS, outside_kind, outside_rope, trial_rope};
use serde::Serialize;
use serde_json::{Value, json};

/// How many ropes of one kind were noticed.
#[derive(Debug, Serialize)]
struct Noticed {
    kind: &'static str,
    ropes: usize,
    found: usize,
}

fn noticed(outside: &[Trial]) -> Vec<Noticed> {
    let of = |(number, kind)| {
        let own = outside
            .iter()
            .filter(|t| outside_kind(t.index / 2) == number);
        Noticed {
            kind,
            ropes: own.clone().count(),
            found: own.filter(|t| t.flagged).count(),
        }
    };
    OUTSIDE_KINDS.into_iter().enumerate().map(of).collect()
}

/// Fraction of some trials flagged as out of distribution.
fn flagged(trials: &[Trial]) -> f64 {
    mean(trials.iter().map(|t| f64::from(u8::from(t.flagged))))
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let seed = experiment.args.seed;
    // Even indices are inside, odd ones outside.
    let rope = |index: u64| {
        if index.is_multiple_of(2) {
            trial_rope(seed, index / 2)
        } else {
            outside_rope(seed, index / 2)
        }
    };
    let made = experiment.identified(2, rope)?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let all = format!("{} ropes", trials.len());
    let (inside, outside): (Vec<Trial>, Vec<Trial>) =
        trials.into_iter().partition(|t| t.index.is_multiple_of(2));
    let scores = |trials: &[Trial]| {
        trials
            .iter()
            .map(|t| t.out_of_distribution)
            .collect::<Vec<f64>>()
    };
    let area = area_under_curve(&scores(&outside), &scores(&inside));
    let curve = |name: &str, trials: &[Trial]| Curve {
        name: name.to_owned(),
        values: scores(trials),
        paper: None,
    };
    let curves = vec![
        curve("ropes of the ranges", &inside),
        curve("chains and ropes beyond the ranges", &outside),
    ];
    let picture = experiment.picture("out-of-distribution score", curves)?;
    let (found, false_alarms) = (flagged(&outside), flagged(&inside));
    let kinds = noticed(&outside);
    let own = json!({
        "ropes_inside": inside.len(), "ropes_outside": outside.len(),
        "area_under_curve": area, "found": found, "false_alarms": false_alarms,
        "kinds": kinds,
    });
    experiment.finish(&all, picture, own, || {
        println!(
            "{} ropes inside, {} outside: area under the curve {area:.3}, {:.1} % found, {:.1} % false alarms",
            inside.len(),
            outside.len(),
            100.0 * found,
            100.0 * false_alarms
        );
        for Noticed { kind, ropes, found } in &kinds {
            println!("{kind}: {found} of {ropes} found");
        }
    })
}
