//! `experiments lob-drape`: lobs and drapes planned with identified parameters over 24
//! ropes, judged in simulation with the true ones, next to the paper's table.

use super::experiment::{Experiment, Sequence, cm};
use super::picture::Curve;
use super::strikes::Thrower;
use crate::report::{Column, print_table};
use anyhow::Context;
use cli_output::{OrInput, Outcome};
use experiments::trials::{alone, in_parallel, mean};
use planner::identify::IdentifyOptions;
use planner::plan::PlanError;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use shared_types::{RopeParams, Task, Verdict};
use toml::Table;

const ROPES: &str = include_str!("../../../configs/planner/lob-drape.toml");

/// Ropes of the comparison. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct LobDrapeConfig {
    lob_target_m: [f64; 3],
    /// Middle of the wall's upper edge (m).
    drape_target_m: [f64; 3],
    /// The rope's parameters that a configuration sets; the kind has the others.
    configurations: Vec<Table>,
    ropes: Vec<Kind>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Kind {
    name: String,
    #[serde(flatten)]
    parameters: Table,
}

impl LobDrapeConfig {
    /// Every kind in every configuration, by name.
    fn ropes(&self) -> Result<Vec<(String, RopeParams)>, toml::de::Error> {
        let rope = |kind: &Kind, configuration: &Table| {
            let mut parameters = kind.parameters.clone();
            parameters.extend(configuration.clone());
            let rope: RopeParams = parameters.try_into()?;
            let (length_cm, lead_g) = (100.0 * rope.length_m, 1e3 * rope.lead_mass_kg);
            let name = format!("{}, {length_cm:.0} cm, {lead_g:.0} g", kind.name);
            Ok((name, rope))
        };
        self.ropes
            .iter()
            .flat_map(|kind| self.configurations.iter().map(move |c| rope(kind, c)))
            .collect()
    }
}

/// One throw judged with the true rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Judged {
    /// What became of it.
    verdict: Verdict,
    /// What the plan expected.
    predicted: Verdict,
    /// The task's error (m): closest approach of a lob, distance of the rope's middle
    /// from the edge for a drape.
    error_m: f64,
    /// Contacts of rope or tool with arm, stand or column, at sampled instants.
    contacts: u32,
    /// Throws simulated to plan it.
    simulations: u32,
}

/// One rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LobDrapeTrial {
    /// Kind, length and lead.
    name: String,
    /// The lob; `None` where no throw without a collision was found.
    lob: Option<Judged>,
    /// The drape, likewise.
    drape: Option<Judged>,
}

fn judged(thrower: &Thrower, found: &RopeParams) -> Result<Option<Judged>, PlanError> {
    let planned = match thrower.plan(found, thrower.options.searches) {
        Err(PlanError::OnlyCollisions { .. }) => return Ok(None),
        planned => planned?,
    };
    let task = thrower.goal.task();
    Ok(thrower.outcome(&planned)?.map(|o| Judged {
        verdict: task.judge(&thrower.truth, &o),
        predicted: planned.verdict,
        error_m: task.error_m(&o),
        contacts: o.contacts.rope_robot + o.contacts.pole_robot + o.contacts.base_region,
        simulations: planned.simulations,
    }))
}

/// Films, identifies and throws the ropes with these indices. The lead is weighed, as
/// anybody would.
fn trials(
    experiment: &Experiment<'_>,
    scene: &LobDrapeConfig,
    ropes: &[(String, RopeParams)],
    indices: &[u64],
) -> anyhow::Result<Vec<LobDrapeTrial>> {
    let seed = experiment.args.seed;
    let (rig, options) = (&experiment.rig, &experiment.options);
    in_parallel("trial", indices, options.threads, |index| {
        let at = usize::try_from(index).unwrap_or(usize::MAX) % ropes.len().max(1);
        let (name, truth) = &ropes[at];
        let filmed = rig.film(truth, seed, index)?;
        let options = IdentifyOptions {
            lead_mass_kg: Some(truth.lead_mass_kg),
            ..alone(options)
        };
        let found = rig.fit(&filmed, index, &options)?.params;
        let judge = |task, target_m| {
            judged(
                &Thrower::new(experiment, index, (task, target_m), *truth),
                &found,
            )
        };
        Ok(LobDrapeTrial {
            name: name.clone(),
            lob: judge(Task::Lob, scene.lob_target_m)?,
            drape: judge(Task::Drape, scene.drape_target_m)?,
        })
    })
}

fn is_target_hit(lob: &Judged) -> bool {
    let mut conditions = lob.verdict.conditions.iter();
    conditions.any(|c| c.name == "target hit" && c.met)
}

const TABLE: [Column<LobDrapeTrial>; 5] = [
    ("rope", |t| t.name.clone()),
    ("lob", |t| or_no_throw(&t.lob, became)),
    ("closest (cm)", |t| {
        or_no_throw(&t.lob, |lob| cm(lob.error_m))
    }),
    ("drape", |t| or_no_throw(&t.drape, became)),
    ("midpoint (cm)", |t| {
        or_no_throw(&t.drape, |drape| cm(drape.error_m))
    }),
];

fn or_no_throw(judged: &Option<Judged>, of: fn(&Judged) -> String) -> String {
    judged.as_ref().map_or_else(|| "no throw".to_owned(), of)
}

/// Whether a throw succeeded, or what it failed.
fn became(judged: &Judged) -> String {
    if judged.verdict.success {
        return "yes".to_owned();
    }
    let failed = judged.verdict.conditions.iter().filter(|c| !c.met);
    let names: Vec<&str> = failed.map(|c| c.name.as_str()).collect();
    format!("no: {}", names.join(", "))
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let damaged = "the built-in `configs/planner/lob-drape.toml` is damaged";
    let scene: LobDrapeConfig = toml::from_str(ROPES).context(damaged).or_failed()?;
    let ropes = scene.ropes().context(damaged).or_failed()?;
    let all = ropes.len() as u64;
    let figure = |t: &LobDrapeTrial| t.drape.as_ref().map_or(f64::NAN, |d| 100.0 * d.error_m);
    let requested = experiment.sequence(all, 1, (figure, "ropes, cm of the drape"));
    let sequence = Sequence {
        count: requested.count.min(all),
        ..requested
    };
    let trials = experiment.trials(sequence, |batch| trials(&experiment, &scene, &ropes, batch))?;
    let fraction = |good: fn(&LobDrapeTrial) -> bool| {
        mean(trials.iter().map(|t| f64::from(u8::from(good(t)))))
    };
    let hit = fraction(|t| t.lob.as_ref().is_some_and(is_target_hit));
    let hit_and_stay = fraction(|t| t.lob.as_ref().is_some_and(|l| l.verdict.success));
    let draped = fraction(|t| t.drape.as_ref().is_some_and(|d| d.verdict.success));
    let draped_m: Vec<f64> = trials
        .iter()
        .filter_map(|t| t.drape.as_ref().filter(|d| d.verdict.success))
        .map(|d| d.error_m)
        .collect();
    let midpoint_m = draped_m.iter().sum::<f64>() / draped_m.len() as f64;
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
        "ropes": trials.len(), "lob_hit": hit, "lob_hit_and_stay": hit_and_stay,
        "draped": draped, "midpoint_m": midpoint_m, "trials": trials,
    });
    let summary = format!("{} ropes", trials.len());
    experiment.finish(&summary, picture, own, || {
        print_table(&trials, 0, TABLE);
        println!(
            "\nlob: {:.0} % hit (paper 54), {:.0} % hit and stay (paper 21); drape: {:.0} % (paper 63), midpoint {:.1} cm over those (paper 4.6)",
            100.0 * hit,
            100.0 * hit_and_stay,
            100.0 * draped,
            100.0 * midpoint_m
        );
    })
}
