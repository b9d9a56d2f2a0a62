//! `experiments lob-drape`: lobs and drapes planned with identified parameters over random ropes,
//! their leads weighed and not, judged in simulation with the true ones, next to the paper's table.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use super::strikes::Thrower;
use crate::report::{Column, print_table};
use anyhow::{Context, anyhow, ensure};
use cli_output::Outcome;
use core::f64::consts::PI;
use experiments::trials::{Rate, alone, in_parallel, mean};
use planner::identify::IdentifyOptions;
use planner::ropes::{TRIAL_SALT, trial_rope};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rig_sim::random_target;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use shared_types::{RopeParams, Task, Verdict};

/// Ropes of a table; each is lobbed and draped, with its lead weighed and not.
const ROPES: u64 = 30;
/// Leads (kg): from the paper's lightest to twice its heaviest, their logarithms drawn
/// uniformly. Those below 0.02 kg lie outside the ranges that the network was trained on.
const LEADS_KG: [f64; 2] = [0.005, 0.06];
/// Of the leads, which are balls (kg/m³).
const DENSITY: f64 = 1200.0;
/// Keeps the draws of leads and of walls apart from those of ropes and boards.
const LEAD_SALT: u64 = 0x001e_ad00_0000;
const WALL_SALT: u64 = 0x0000_a110_0000;
/// What the scale shows (kg).
const SCALE_KG: f64 = 1e-4;

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

/// Both throws with one estimate; `None` where no rope fitted, or no throw was found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Throws {
    lob: Option<Judged>,
    drape: Option<Judged>,
    /// Why there is no throw.
    failed: Vec<String>,
}

/// One rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct LobDrapeTrial {
    index: u64,
    truth: RopeParams,
    lob_target_m: [f64; 3],
    /// Middle of the wall's upper edge (m).
    drape_target_m: [f64; 3],
    /// With the lead as the scale shows it.
    weighed: Throws,
    /// With what the film tells of it.
    unweighed: Throws,
}

/// Rope `index` of a seed, with a lead of these tables.
fn rope(seed: u64, index: u64) -> RopeParams {
    let mut rng = ChaCha12Rng::seed_from_u64(TRIAL_SALT ^ LEAD_SALT ^ (seed << 32) ^ index);
    let [lightest, heaviest] = LEADS_KG.map(f64::ln);
    let lead_mass_kg = rng.random_range(lightest..=heaviest).exp();
    RopeParams {
        lead_mass_kg,
        lead_radius_m: (lead_mass_kg / DENSITY / (4.0 / 3.0 * PI)).cbrt(),
        ..trial_rope(seed, index)
    }
}

fn judged(thrower: &Thrower, found: &RopeParams) -> anyhow::Result<Judged> {
    let planned = thrower.plan(found, thrower.options.searches)?;
    let task = thrower.goal.task();
    let thrown = thrower.outcome(&planned)?;
    let o = thrown.context("the throw with the true rope cannot be simulated")?;
    let error_m = task.error_m(&o);
    ensure!(error_m.is_finite(), "the throw with the true rope diverged");
    Ok(Judged {
        verdict: task.judge(&thrower.truth, &o),
        predicted: planned.verdict,
        error_m,
        contacts: o.contacts.rope_robot + o.contacts.pole_robot + o.contacts.base_region,
        simulations: planned.simulations,
    })
}

/// Films, identifies and throws the rope `index`.
fn trial(experiment: &Experiment<'_>, index: u64) -> anyhow::Result<LobDrapeTrial> {
    let (seed, rig) = (experiment.args.seed, &experiment.rig);
    let truth = rope(seed, index);
    let filmed = rig.film(&truth, seed, index)?;
    let salted = (seed << 32) ^ index;
    let lob_target_m = random_target(Task::Lob, salted);
    let drape_target_m = random_target(Task::Drape, salted ^ WALL_SALT);
    let throws = |lead_mass_kg| {
        let options = IdentifyOptions {
            lead_mass_kg,
            ..alone(&experiment.options)
        };
        let mut failed = Vec::new();
        let found = rig.fit(&filmed, index, &options);
        let mut throw = |task: Task, target_m| {
            let thrower = Thrower::new(experiment, index, (task, target_m), truth);
            let found = found.as_ref().map_err(|why| anyhow!("{why}"));
            found
                .and_then(|found| judged(&thrower, &found.params))
                .map_err(|why| failed.push(format!("{}: {why:#}", task.name())))
                .ok()
        };
        Throws {
            lob: throw(Task::Lob, lob_target_m),
            drape: throw(Task::Drape, drape_target_m),
            failed,
        }
    };
    let shown_kg = (truth.lead_mass_kg / SCALE_KG).round() * SCALE_KG;
    Ok(LobDrapeTrial {
        index,
        truth,
        lob_target_m,
        drape_target_m,
        weighed: throws(Some(shown_kg)),
        unweighed: throws(None),
    })
}

/// What the throws with one kind of estimate add up to. Where there is no throw, none succeeded.
#[derive(Debug, Serialize)]
struct Row {
    lead: &'static str,
    lob_hit: Rate,
    /// Hit, domino down and the tip stays.
    lob_success: Rate,
    drape_success: Rate,
    /// Mean distance of the rope's middle from the edge, of drapes that succeeded (m).
    midpoint_m: Option<f64>,
    /// Throws in which rope or tool touched the robot.
    touched: Rate,
    /// Lobs and drapes without a throw.
    no_throw: usize,
}

impl Row {
    fn of(lead: &'static str, throws: &[&Throws]) -> Self {
        let lobs: Vec<Option<&Judged>> = throws.iter().map(|t| t.lob.as_ref()).collect();
        let drapes: Vec<Option<&Judged>> = throws.iter().map(|t| t.drape.as_ref()).collect();
        let rate = |judged: &[Option<&Judged>], good: fn(&Judged) -> bool| {
            Rate::of(judged.iter().map(|judged| judged.is_some_and(good)))
        };
        let succeeded = |judged: &Judged| judged.verdict.success;
        let draped = drapes.iter().flatten().filter(|d| succeeded(d));
        let draped_m: Vec<f64> = draped.map(|d| d.error_m).collect();
        let thrown = || lobs.iter().chain(&drapes).flatten();
        Self {
            lead,
            lob_hit: rate(&lobs, is_target_hit),
            lob_success: rate(&lobs, succeeded),
            drape_success: rate(&drapes, succeeded),
            midpoint_m: (!draped_m.is_empty()).then(|| mean(draped_m)),
            touched: Rate::of(thrown().map(|judged| judged.contacts > 0)),
            no_throw: 2 * throws.len() - thrown().count(),
        }
    }
}

fn is_target_hit(lob: &Judged) -> bool {
    let mut conditions = lob.verdict.conditions.iter();
    conditions.any(|c| c.name == "target hit" && c.met)
}

const TABLE: [Column<Row>; 7] = [
    ("lead", |row| row.lead.to_owned()),
    ("lob: hit", |row| row.lob_hit.to_string()),
    ("down and stay", |row| row.lob_success.to_string()),
    ("drape", |row| row.drape_success.to_string()),
    ("middle of those (cm)", |row| {
        cm(row.midpoint_m.unwrap_or(f64::NAN))
    }),
    ("touch the robot", |row| row.touched.to_string()),
    ("no throw", |row| row.no_throw.to_string()),
];

/// An estimate, and the throws planned with it.
type Condition = (&'static str, fn(&LobDrapeTrial) -> &Throws);

const CONDITIONS: [Condition; 2] = [
    ("weighed", |t| &t.weighed),
    ("not weighed", |t| &t.unweighed),
];

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let figure = |t: &LobDrapeTrial| {
        let drape = t.unweighed.drape.as_ref();
        drape.map_or(f64::NAN, |d| 100.0 * d.error_m)
    };
    let sequence = experiment.sequence(ROPES, 1, (figure, "ropes, cm of the drape"));
    let threads = experiment.options.threads;
    let made = experiment.trials(sequence, |batch| {
        in_parallel("trial", batch, threads, |index| trial(&experiment, index))
    })?;
    let Some(trials) = made else {
        return experiment.finish_shard();
    };
    let rows = CONDITIONS.map(|(lead, of)| {
        let throws: Vec<&Throws> = trials.iter().map(of).collect();
        Row::of(lead, &throws)
    });
    // A rope without a throw never comes near.
    let curve = |name: &str, paper_cm, of: fn(&Throws) -> &Option<Judged>| {
        let throws = trials.iter().map(|t| of(&t.unweighed).as_ref());
        let errors_m = throws.map(|judged| judged.map_or(f64::INFINITY, |j| j.error_m));
        Curve::cm(name, errors_m, paper_cm)
    };
    let curves = vec![
        curve("lob: closest approach", None, |t| &t.lob),
        curve("drape: middle of the rope from the edge", Some(4.6), |t| {
            &t.drape
        }),
    ];
    let axis = "distance (cm), leads not weighed; dashed: the paper's mean of drapes";
    let picture = experiment.picture(axis, curves)?;
    let own = json!({ "ropes": trials.len(), "rows": rows, "trials": trials });
    let summary = format!("{} ropes", trials.len());
    experiment.finish(&summary, picture, own, || {
        print_table(&rows, 0, TABLE);
        println!(
            "\npaper, real arm: lob 54 % hit, 21 % down and stay (Φ-NN), 63 %, 38 % (Φ-CMA-ES); drape 63 %, 4.6 cm (Φ-NN), 67 %, 4.1 cm (Φ-CMA-ES)"
        );
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_types::Condition;

    fn thrown(conditions: &[(&str, bool)], error_m: f64, contacts: u32) -> Option<Judged> {
        let conditions = conditions.iter().map(|(name, met)| Condition {
            name: (*name).to_owned(),
            met: *met,
        });
        let conditions: Vec<Condition> = conditions.collect();
        let verdict = Verdict {
            success: conditions.iter().all(|c| c.met),
            conditions,
            unseen: Vec::new(),
        };
        Some(Judged {
            verdict: verdict.clone(),
            predicted: verdict,
            error_m,
            contacts,
            simulations: 1,
        })
    }

    #[test]
    fn rows_count_what_failed_and_leave_out_what_was_not_thrown() {
        let throws = |lob, drape| Throws {
            lob,
            drape,
            failed: Vec::new(),
        };
        let all = [
            throws(
                thrown(&[("target hit", true), ("stay", true)], 0.0, 0),
                thrown(&[("cleared", true)], 0.02, 0),
            ),
            throws(
                thrown(&[("target hit", true), ("stay", false)], 0.0, 3),
                thrown(&[("cleared", false)], 0.5, 0),
            ),
            throws(
                thrown(&[("target hit", false), ("stay", false)], 0.3, 0),
                None,
            ),
        ];
        let row = Row::of("weighed", &all.each_ref());
        let counts = |rate: Rate| (rate.hits, rate.n);
        assert_eq!(counts(row.lob_hit), (2, 3));
        assert_eq!(counts(row.lob_success), (1, 3));
        assert_eq!(counts(row.drape_success), (1, 3));
        assert_eq!(row.midpoint_m, Some(0.02));
        assert_eq!((counts(row.touched), row.no_throw), ((1, 5), 1));
        assert_eq!(Row::of("weighed", &[&all[1]]).midpoint_m, None);
    }

    #[test]
    fn leads_are_those_of_the_tables_and_of_one_density() {
        for index in 0..200 {
            let rope = rope(1, index);
            assert!((LEADS_KG[0]..=LEADS_KG[1]).contains(&rope.lead_mass_kg));
            assert!((0.0099..0.0230).contains(&rope.lead_radius_m), "{rope:?}");
            assert!(rope.validate().is_ok());
        }
    }
}
