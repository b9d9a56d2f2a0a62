//! `experiments lob-drape`: lobs and drapes planned with identified parameters over 24
//! ropes, judged in simulation with the true ones, beside the paper's table.

use super::checkpoint::{Sequence, checkpointed_trials};
use super::picture::{Curve, Picture};
use super::setup::Setup;
use crate::args::ResultArgs;
use anyhow::Context;
use cli_output::Stage;
use cli_output::table::numbers;
use cli_output::{OrInput, Outcome};
use experiments::trials::{LobDrapeConfig, LobDrapeTrial, lob_drape_trials};
use serde_json::{Value, json};
use shared_types::Verdict;

const ROPES: &str = include_str!("../../../configs/planner/lob-drape.toml");

/// Parts of the ropes, and the distance of drapes.
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
    #[allow(clippy::cast_precision_loss, reason = "two dozen ropes")]
    let part = |good: &dyn Fn(&LobDrapeTrial) -> bool| {
        trials.iter().filter(|t| good(t)).count() as f64 / trials.len().max(1) as f64
    };
    let lob = |t: &LobDrapeTrial, name: &str| t.lob.as_ref().is_some_and(|l| met(&l.verdict, name));
    let draped: Vec<f64> = trials
        .iter()
        .filter_map(|t| t.drape.as_ref().filter(|d| d.verdict.success))
        .map(|d| d.error_m)
        .collect();
    #[allow(clippy::cast_precision_loss, reason = "two dozen ropes")]
    let midpoint_m = draped.iter().sum::<f64>() / draped.len() as f64;
    Summary {
        hit: part(&|t| lob(t, "target hit")),
        hit_and_stay: part(&|t| t.lob.as_ref().is_some_and(|l| l.verdict.success)),
        draped: part(&|t| t.drape.as_ref().is_some_and(|d| d.verdict.success)),
        midpoint_m,
    }
}

pub(super) fn run(args: &ResultArgs, quiet: bool) -> Outcome<Option<Value>> {
    let Setup {
        config,
        rig,
        options,
    } = Setup::new(args)?;
    let method = options.method;
    let scene: LobDrapeConfig = toml::from_str(ROPES)
        .context("the built-in `configs/planner/lob-drape.toml` is damaged")
        .or_failed()?;
    let stage = Stage::begin("lob-drape", quiet);
    let all = scene.ropes().len() as u64;
    let sequence = Sequence {
        name: "lob-drape",
        method: format!("{method:?}").to_lowercase(),
        count: args.ropes.unwrap_or(all).min(all),
        batch: options.threads.max(1),
        told: (
            |t: &LobDrapeTrial| t.drape.as_ref().map_or(f64::NAN, |d| 100.0 * d.error_m),
            "ropes, cm of the drape",
        ),
    };
    let trials = checkpointed_trials(&sequence, args, &stage, |batch| {
        lob_drape_trials(&rig, &config, &scene, &options, args.seed, batch).or_failed()
    })?;
    let s = summarise(&trials);
    let curve = |name: &str, paper, of: fn(&LobDrapeTrial) -> Option<f64>| Curve {
        name: name.to_owned(),
        // A rope without a throw never comes near.
        values: trials
            .iter()
            .map(|t| of(t).map_or(f64::INFINITY, |m| 100.0 * m))
            .collect(),
        paper,
    };
    let picture = Picture {
        name: "lob-drape",
        axis: "distance (cm); dashed: the paper's mean of drapes",
        seed: args.seed,
        curves: vec![
            curve("lob: closest approach", None, |t| {
                t.lob.as_ref().map(|l| l.error_m)
            }),
            curve("drape: middle of the rope from the edge", Some(4.6), |t| {
                t.drape.as_ref().map(|d| d.error_m)
            }),
        ],
    };
    let picture = picture.write(args.out.as_deref())?;
    let seconds = stage.done(&format!("{} ropes", trials.len()));
    if !quiet {
        print(&trials, &s);
    }
    Ok(Some(json!({
        "ok": true, "command": "lob-drape", "version": shared_types::VERSION,
        "seed": args.seed, "method": method, "ropes": trials.len(), "seconds": seconds,
        "lob_hit": s.hit, "lob_hit_and_stay": s.hit_and_stay, "draped": s.draped,
        "midpoint_m": s.midpoint_m, "trials": trials, "out": args.out, "picture": picture,
    })))
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
            lob.map_or_else(none, |l| format!("{:.2}", 100.0 * l.error_m)),
            drape.map_or_else(none, |d| failed(&d.verdict)),
            drape.map_or_else(none, |d| format!("{:.2}", 100.0 * d.error_m)),
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
