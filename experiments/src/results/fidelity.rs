//! `experiments motion-fidelity`: does a rope identified from one noisy wiggle move like the
//! real one in a motion it was not identified from?
//!
//! Truth comes from outside the model class: more links than the ranges have, air drag,
//! uneven mass distribution, a rest curvature. As in the paper, a throw is compared by the
//! correlation of Fourier spectra and by the mean distance of points of the rope per frame.

use super::experiment::{Experiment, cm};
use super::picture::Curve;
use super::spectra::{Points, mean_distance_m, spectra_correlation};
use crate::report::{Column, print_table};
use anyhow::Context;
use arm_model::{JointTrajectory, Pole};
use cli_output::{OrInput, Outcome, interrupted};
use experiments::trials::{KEYPOINTS, TrialRig, mean};
use planner::PlannerConfig;
use planner::plan::{PlanOptions, PlanRequest};
use planner::ropes::trial_rope;
use planner::synthetic::{FilmTiming, RopeFilm, SyntheticFilm, project};
use rope_sim::{
    AttachMotion, Candidate, FrameTimes, PlannedArm, Precision, SimOptions, SimulateError, roll_out,
};
use run_log::files;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use shared_types::rope::RANGES;
use shared_types::{AirDrag, RopeExtras, RopeParams, Task};
use std::ops::ControlFlow;
use std::sync::atomic::Ordering;
use toml::Table;

const ROPES: &str = include_str!("../../../configs/planner/fidelity.toml");
/// Where the compared throw would have to strike (m).
const TARGET_M: [f64; 3] = [1.0, 0.0, 0.4];
/// Frames a second and duration of the compared motion (s).
const RATE_HZ: f64 = 60.0;
const COMPARED_S: f64 = 2.5;
/// Frames a second of a film before the camera's own are taken from it.
const FILM_RATE_HZ: f64 = 240.0;
/// Extra scale of links that are solid cylinders.
const CYLINDER_SCALE: f64 = 0.913;

/// Ropes of the comparison. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FidelityConfig {
    #[serde(with = "Air")]
    air: AirDrag,
    leads: Leads,
    ropes: Vec<Kind>,
}

/// Form of an [`AirDrag`] in the file.
#[derive(Deserialize)]
#[serde(remote = "AirDrag", deny_unknown_fields)]
struct Air {
    air_density_kg_m3: f64,
    normal_coefficient: f64,
    tangential_coefficient: f64,
    lead_coefficient: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Leads {
    masses_kg: Vec<f64>,
    radius_m: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Kind {
    name: String,
    curvature_per_m: f64,
    mass_slope: f64,
    /// The rope's parameters but for those of its lead and links.
    #[serde(flatten)]
    parameters: Table,
}

/// A rope with physics beyond the nine parameters, some of them outside the ranges.
#[derive(Debug, Clone, PartialEq)]
struct RealRope {
    /// Kind and lead.
    name: String,
    params: RopeParams,
}

impl FidelityConfig {
    /// Every kind with every lead.
    fn ropes(&self) -> Result<Vec<RealRope>, toml::de::Error> {
        let with = |kind: &Kind, lead_mass_kg: f64| {
            let mut parameters = kind.parameters.clone();
            for (key, value) in [
                ("lead_mass_kg", lead_mass_kg),
                ("lead_radius_m", self.leads.radius_m),
                ("link_extra_scale", CYLINDER_SCALE),
            ] {
                parameters.insert(key.to_owned(), value.into());
            }
            let extras = RopeExtras {
                air_drag: Some(self.air),
                rest_curvature_per_m: [0.0, kind.curvature_per_m, 0.0],
                mass_slope: kind.mass_slope,
                ..RopeExtras::NONE
            };
            Ok(RealRope {
                name: format!("{}, {:.0} g", kind.name, 1e3 * lead_mass_kg),
                params: parameters.try_into::<RopeParams>()?.with_extras(extras),
            })
        };
        self.ropes
            .iter()
            .flat_map(|kind| self.leads.masses_kg.iter().map(move |m| with(kind, *m)))
            .collect()
    }
}

/// One rope compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct FidelityRow {
    /// Kind and lead.
    name: String,
    /// Pearson correlation of the spectra of all points.
    frequency_correlation: f64,
    /// Mean distance of points of the rope per frame (m).
    distance_m: f64,
    /// The same of a rope of the ranges' middle (m).
    middle_distance_m: f64,
    /// Correlation and distance of a rope drawn from the ranges.
    random_correlation: f64,
    random_distance_m: f64,
    /// Distance of the fit to the keypoints (px).
    residual_px: f64,
    /// Method as the estimate names it.
    method: String,
}

const TABLE: [Column<FidelityRow>; 7] = [
    ("rope, lead", |row| row.name.clone()),
    ("frequency correlation", |row| {
        format!("{:.4}", row.frequency_correlation)
    }),
    ("cm per frame", |row| cm(row.distance_m)),
    ("middle of ranges (cm)", |row| cm(row.middle_distance_m)),
    ("random rope (cm)", |row| cm(row.random_distance_m)),
    ("residual (px)", |row| format!("{:.2}", row.residual_px)),
    ("method", |row| row.method.clone()),
];

/// Keypoint paths of a rope in a motion.
fn paths(
    rope: &RopeParams,
    motion: &dyn AttachMotion,
    duration_s: f64,
    rate_hz: f64,
) -> Result<Vec<Points>, SimulateError> {
    let options = SimOptions {
        frames: FrameTimes {
            first_s: 0.0,
            period_s: 1.0 / rate_hz,
            count: (duration_s * rate_hz).floor() as usize,
        },
        ..SimOptions::new(5e-4, Precision::F64, duration_s)
    };
    let rollouts = roll_out(&[Candidate::new(rope, motion)], &options)?;
    let nodes = &rollouts[0].nodes;
    let point = |frame: usize, k: usize| {
        let place = k as f64 * (nodes.nodes() - 1) as f64 / (KEYPOINTS - 1) as f64;
        let node = (place as usize).min(nodes.nodes() - 2);
        nodes
            .position(frame, node)
            .lerp(&nodes.position(frame, node + 1), place - node as f64)
    };
    Ok((0..nodes.frames())
        .map(|frame| (0..KEYPOINTS).map(|k| point(frame, k)).collect())
        .collect())
}

/// Films a rope with extras and the errors of recording `index` of `seed`.
fn film(rig: &TrialRig, rope: &RealRope, seed: u64, index: u64) -> anyhow::Result<SyntheticFilm> {
    let duration_s = rig.motion.duration_s();
    let paths = paths(&rope.params, &rig.motion, duration_s, FILM_RATE_HZ)?;
    let points = paths.iter().flatten();
    let positions = points.flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]);
    let (period_s, positions) = (1.0 / FILM_RATE_HZ, positions.collect());
    let film = RopeFilm::from_positions(rope.params, period_s, KEYPOINTS, positions)
        .context("the film has no frame; film longer")?;
    let noise = rig.randomisation.draw(seed, index);
    Ok(project(&film, &rig.camera, &FilmTiming::default(), &noise))
}

/// Identifies a rope from its film and compares it in another motion.
fn compare(
    experiment: &Experiment<'_>,
    rope: &RealRope,
    throw: &JointTrajectory,
    index: u64,
) -> anyhow::Result<FidelityRow> {
    let (rig, seed) = (&experiment.rig, experiment.args.seed);
    let filmed = film(rig, rope, seed, index)?;
    let found = rig.fit(&filmed, index, &experiment.options)?;
    let arm = PlannedArm::new(*throw, Pole::default());
    let moved = |rope: &RopeParams| paths(rope, &arm, COMPARED_S, RATE_HZ);
    let truth = moved(&rope.params)?;
    let found_paths = moved(&found.params)?;
    let middle = moved(&middle_rope())?;
    let random = moved(&trial_rope(seed, index))?;
    Ok(FidelityRow {
        name: rope.name.clone(),
        frequency_correlation: spectra_correlation(&truth, &found_paths),
        distance_m: mean_distance_m(&truth, &found_paths),
        middle_distance_m: mean_distance_m(&truth, &middle),
        random_correlation: spectra_correlation(&truth, &random),
        random_distance_m: mean_distance_m(&truth, &random),
        residual_px: found.residual_px,
        method: found.method.to_string(),
    })
}

/// The rope of the middle of every range.
fn middle_rope() -> RopeParams {
    RopeParams::from_array(RANGES.map(|r| f64::midpoint(r.min, r.max)))
}

/// A throw planned for the middle of the ranges: it favours none of the compared ropes.
fn throw(config: &PlannerConfig, seed: u64) -> anyhow::Result<JointTrajectory> {
    let options = PlanOptions {
        seed,
        ..config.search
    };
    let request = PlanRequest::new(config.goal(Task::Strike, TARGET_M), &middle_rope(), options);
    let plan = planner::plan(&request, &mut |_| ControlFlow::Continue(()))?;
    Ok(plan.trajectory)
}

pub(super) fn run(experiment: Experiment<'_>) -> Outcome<Option<Value>> {
    let args = experiment.args;
    if !args.shard.is_whole() {
        return Err(bad_input!(
            "motion-fidelity has ten ropes and no shards: leave out --shard"
        ));
    }
    let ropes = toml::from_str::<FidelityConfig>(ROPES)
        .and_then(|config| config.ropes())
        .context("the built-in `configs/planner/fidelity.toml` is damaged")
        .or_failed()?;
    let throw = throw(&experiment.config, args.seed).or_failed()?;
    let mut rows: Vec<FidelityRow> = Vec::new();
    for (index, rope) in (0_u64..).zip(&ropes) {
        if interrupted().load(Ordering::SeqCst) {
            return Err(failed!("interrupted"));
        }
        let row = compare(&experiment, rope, &throw, index);
        let row = row.with_context(|| rope.name.clone()).or_failed()?;
        let value_cm = 100.0 * row.distance_m;
        rows.push(row);
        experiment.progress(rows.len(), ropes.len(), value_cm, "ropes, cm per frame");
    }
    let mean = |of: fn(&FidelityRow) -> f64| mean(rows.iter().map(of));
    let own = json!({
        "frequency_correlation": mean(|r| r.frequency_correlation),
        "distance_m": mean(|r| r.distance_m),
        "middle_distance_m": mean(|r| r.middle_distance_m),
        "random_correlation": mean(|r| r.random_correlation),
        "random_distance_m": mean(|r| r.random_distance_m), "ropes": rows,
    });
    let curve = |name: &str, paper, of: fn(&FidelityRow) -> f64| {
        Curve::cm(name, rows.iter().map(of), paper)
    };
    let curves = vec![
        curve("identified", Some(5.4), |r| r.distance_m),
        curve("middle of the ranges", None, |r| r.middle_distance_m),
        curve("random ropes", None, |r| r.random_distance_m),
    ];
    let axis = "mean distance per frame (cm); dashed: the paper's";
    let picture = experiment.picture(axis, curves)?;
    let out = args.out.as_ref();
    let summary = format!("{} ropes", rows.len());
    let value = experiment.finish(&summary, picture, own, || {
        print_table(&rows, 1, TABLE);
        println!(
            "\nmean: correlation {:.4} (paper 0.95), {} cm per frame (paper 5.4)\nfor scale: middle of the ranges {} cm; random ropes of the ranges correlation {:.4}, {} cm",
            mean(|r| r.frequency_correlation),
            cm(mean(|r| r.distance_m)),
            cm(mean(|r| r.middle_distance_m)),
            mean(|r| r.random_correlation),
            cm(mean(|r| r.random_distance_m))
        );
    })?;
    if let Some(path) = out {
        files::write_json(path, &value).or_failed()?;
    }
    Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_configured_ropes_are_ten_and_outside_the_model() {
        let ropes = toml::from_str::<FidelityConfig>(ROPES).unwrap().ropes();
        let ropes = ropes.unwrap();
        assert_eq!(ropes.len(), 10);
        for rope in ropes {
            assert!(rope.params.validate().is_ok() && rope.params.links > 26);
            assert!(rope.params.beyond().air_drag.is_some(), "{rope:?}");
            assert!(rope.params.beyond().mass_slope.abs() >= 0.1, "{rope:?}");
        }
    }
}
