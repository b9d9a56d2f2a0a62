//! Lobs and drapes planned with identified parameters, judged with the true rope.

use super::thrower::Thrower;
use super::{FailedTrial, TrialRig, alone, in_parallel};
use planner::PlannerConfig;
use planner::identify::IdentifyOptions;
use planner::plan::{PlanError, PlanOptions, PosteriorEnsemble};
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, Task, Verdict};

/// Ropes of the comparison. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LobDrapeConfig {
    /// Targets (m).
    pub lob_target_m: [f64; 3],
    /// Middle of the wall's upper edge (m).
    pub drape_target_m: [f64; 3],
    configurations: Vec<Configuration>,
    ropes: Vec<Kind>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Configuration {
    length_m: f64,
    lead_mass_kg: f64,
    lead_radius_m: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Kind {
    name: String,
    links: u32,
    joint_stiffness_nm_per_rad: f64,
    joint_damping_nms_per_rad: f64,
    radius_m: f64,
    mass_per_length_kg_per_m: f64,
    link_extra_scale: f64,
}

impl LobDrapeConfig {
    /// Every kind in every configuration, by name.
    #[must_use]
    pub fn ropes(&self) -> Vec<(String, RopeParams)> {
        let rope = |kind: &Kind, c: &Configuration| {
            let name = format!(
                "{}, {:.0} cm, {:.0} g",
                kind.name,
                100.0 * c.length_m,
                1e3 * c.lead_mass_kg
            );
            let params = RopeParams {
                links: kind.links,
                length_m: c.length_m,
                joint_damping_nms_per_rad: kind.joint_damping_nms_per_rad,
                joint_stiffness_nm_per_rad: kind.joint_stiffness_nm_per_rad,
                radius_m: kind.radius_m,
                mass_per_length_kg_per_m: kind.mass_per_length_kg_per_m,
                lead_mass_kg: c.lead_mass_kg,
                lead_radius_m: c.lead_radius_m,
                link_extra_scale: kind.link_extra_scale,
            };
            (name, params)
        };
        self.ropes
            .iter()
            .flat_map(|kind| self.configurations.iter().map(move |c| rope(kind, c)))
            .collect()
    }
}

/// One throw judged with the true rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// What became of it.
    pub verdict: Verdict,
    /// What the plan expected.
    pub predicted: Verdict,
    /// The task's error (m): closest approach of a lob, distance of the rope's middle
    /// from the edge for a drape.
    pub error_m: f64,
    /// Contacts of rope or tool with arm, stand or column, at sampled instants.
    pub contacts: u32,
    /// Throws simulated to plan it.
    pub simulations: u32,
}

/// One rope.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LobDrapeTrial {
    /// Kind, length and lead.
    pub name: String,
    /// The lob; `None` where no throw without a collision was found.
    pub lob: Option<Judged>,
    /// The drape, likewise.
    pub drape: Option<Judged>,
}

fn judged(thrower: &Thrower, found: &RopeParams) -> Result<Option<Judged>, PlanError> {
    let planned = match thrower.plan(
        found,
        thrower.options.searches,
        PosteriorEnsemble::default(),
    ) {
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
///
/// # Errors
/// The first trial that cannot be made.
pub fn lob_drape_trials(
    rig: &TrialRig,
    config: &PlannerConfig,
    scene: &LobDrapeConfig,
    options: &IdentifyOptions,
    indices: &[u64],
) -> Result<Vec<LobDrapeTrial>, FailedTrial> {
    let (ropes, seed) = (scene.ropes(), options.seed);
    in_parallel(indices, options.threads, |index| {
        let at = usize::try_from(index).unwrap_or(usize::MAX) % ropes.len().max(1);
        let (name, truth) = &ropes[at];
        let filmed = rig.film(truth, seed, index)?;
        let options = IdentifyOptions {
            lead_mass_kg: Some(truth.lead_mass_kg),
            ..alone(options)
        };
        let found = rig.fit(&filmed, index, &options)?.params;
        let judge = |kind, target_m| {
            let thrower = Thrower {
                goal: config.goal(kind, target_m),
                options: PlanOptions {
                    seed: seed ^ index,
                    threads: 1,
                    ..config.search
                },
                truth: *truth,
            };
            judged(&thrower, &found)
        };
        Ok(LobDrapeTrial {
            name: name.clone(),
            lob: judge(Task::Lob, scene.lob_target_m)?,
            drape: judge(Task::Drape, scene.drape_target_m)?,
        })
    })
}
