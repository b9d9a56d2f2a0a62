//! `experiments lob-drape`: lobs and drapes planned with identified parameters over 24
//! ropes, judged in simulation with the true ones, next to the paper's table.

use super::experiment::{Experiment, Sequence, cm};
use super::picture::Curve;
use anyhow::Context;
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome};
use experiments::trials::{LobDrapeConfig, LobDrapeTrial, lob_drape_trials, mean};
use serde_json::{Value, json};
use shared_types::Verdict;

const ROPES: &str = include_str!("../../../configs/planner/lob-drape.toml");

/// Fractions of the ropes, and the distance of drapes.
struct Summary {
    hit: f64,
    hit_and_stay: f64,
    draped: f64,
    midpoint_m: f64,
}

fn met(verdict: &Verdict, name: &str) -> bool {
    verdict.conditions.iter().any(|c| c.name == name && c.met)
}

fn summarise(trials: &[LobDrapeTrial]) -> Summary {
    let fraction = |good: &dyn Fn(&LobDrapeTrial) -> bool| {
        mean(trials.iter().map(|t| f64::from(u8::from(good(t)))))
    };
    let lob = |t: &LobDrapeTrial, name: &str| t.lob.as_ref().is_some_and(|l| met(&l.verdict, name));
    let draped: Vec<f64> = trials
        .iter()
        .filter_map(|t| t.drape.as_ref().filter(|d| d.verdict.success))
        .map(|d| d.error_m)
        .collect();
    let midpoint_m = draped.iter().sum::<f64>() / draped.len() as f64;
    Summary {
        hit: fraction(&|t| lob(t, "target hit")),
        hit_and_stay: fraction(&|t| t.lob.as_ref().is_some_and(|l| l.verdict.success)),
        draped: fraction(&|t| t.drape.as_ref().is_some_and(|d| d.verdict.success)),
        midpoint_m,
    }
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let Experiment {
        config,
        rig,
        options,
        ..
    } = &experiment;
    let scene: LobDrapeConfig = toml::from_str(ROPES)
        .context("the built-in `configs/planner/lob-drape.toml` is damaged")
        .or_failed()?;
    let all = scene.ropes().len() as u64;
    let figure = |t: &LobDrapeTrial| t.drape.as_ref().map_or(f64::NAN, |d| 100.0 * d.error_m);
    let asked = experiment.sequence(all, 1, (figure, "ropes, cm of the drape"));
    let sequence = Sequence {
        count: asked.count.min(all),
        ..asked
    };
    let trials = experiment.trials(sequence, |batch| {
        lob_drape_trials(rig, config, &scene, options, batch)
    })?;
    let s = summarise(&trials);
    // A rope without a throw never comes near.
    let curve = |name: &str, paper, of: fn(&LobDrapeTrial) -> Option<f64>| {
        let errors_m = trials.iter().map(|t| of(t).unwrap_or(f64::INFINITY));
        Curve::cm(name, errors_m, paper)
    };
    let curves = vec![
        curve("lob: closest approach", None, |t| {
            t.lob.as_ref().map(|l| l.error_m)
        }),
        curve("drape: middle of the rope from the edge", Some(4.6), |t| {
            t.drape.as_ref().map(|d| d.error_m)
        }),
    ];
    let axis = "distance (cm); dashed: the paper's mean of drapes";
    let picture = experiment.picture(axis, curves)?;
    let own = json!({
        "ropes": trials.len(), "lob_hit": s.hit, "lob_hit_and_stay": s.hit_and_stay,
        "draped": s.draped, "midpoint_m": s.midpoint_m, "trials": trials,
    });
    let summary = format!("{} ropes", trials.len());
    experiment.finish(&summary, picture, own, || print(&trials, &s))
}

fn print(trials: &[LobDrapeTrial], s: &Summary) {
    let failed = |v: &Verdict| {
        let names = v.conditions.iter().filter(|c| !c.met);
        let names: Vec<&str> = names.map(|c| c.name.as_str()).collect();
        if v.success {
            "yes".to_owned()
        } else {
            format!("no: {}", names.join(", "))
        }
    };
    let lines = trials.iter().map(|t| {
        let none = || "no throw".to_owned();
        let lob = t.lob.as_ref();
        let drape = t.drape.as_ref();
        [
            t.name.clone(),
            lob.map_or_else(none, |l| failed(&l.verdict)),
            lob.map_or_else(none, |l| cm(l.error_m)),
            drape.map_or_else(none, |d| failed(&d.verdict)),
            drape.map_or_else(none, |d| cm(d.error_m)),
        ]
    });
    let header = ["rope", "lob", "closest (cm)", "drape", "midpoint (cm)"];
    println!("{}", numbers(header, 0, lines));
    println!(
        "\nlob: {:.0} % hit (paper 54), {:.0} % hit and stay (paper 21); drape: {:.0} % (paper 63), midpoint {:.1} cm over those (paper 4.6)",
        100.0 * s.hit,
        100.0 * s.hit_and_stay,
        100.0 * s.draped,
        100.0 * s.midpoint_m
    );
}
