//! Motion fidelity: does a rope identified from one wiggle move like the real one in a
//! motion it was not identified from?
//!
//! Truth comes from outside the model class: more links than the ranges have, air drag,
//! uneven mass, a rest curvature. As in the paper, a throw is compared by the correlation of Fourier
//! spectra and by the mean distance of points of the rope per frame.

use super::{KEYPOINTS, TrialError, TrialRig, mean, trial_rope};
use arm_model::JointTrajectory;
use arm_model::Pole;
use nalgebra::Vector3;
use planner::identify::IdentifyOptions;
use planner::synthetic::{FilmTiming, Filmed, RopeFilm, project};
use rope_sim::{
    AirDrag, AttachMotion, Candidate, FrameTimes, PlannedArm, Precision, RopeExtras, SimOptions,
    SimulateError, Start, Watch, roll_out,
};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;

/// Frames a second and duration of the compared motion (s).
const RATE_HZ: f64 = 60.0;
const COMPARED_S: f64 = 2.5;
/// Frequencies compared: harmonics of one over the duration.
const HARMONICS: u32 = 40;
/// Extra scale of links that are solid cylinders.
const CYLINDER_SCALE: f64 = 0.913;

/// Ropes of the comparison. TOML form: keys as the fields.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FidelityConfig {
    air: Air,
    leads: Leads,
    ropes: Vec<Kind>,
}

#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
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
#[serde(deny_unknown_fields)]
struct Kind {
    name: String,
    links: u32,
    length_m: f64,
    joint_stiffness_nm_per_rad: f64,
    joint_damping_nms_per_rad: f64,
    radius_m: f64,
    mass_per_length_kg_per_m: f64,
    curvature_per_m: f64,
    mass_slope: f64,
}

/// A rope with physics beyond the nine parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct RealRope {
    /// Kind and lead.
    pub name: String,
    /// Its parameters, some outside the ranges.
    pub params: RopeParams,
    /// What else it has.
    pub extras: RopeExtras,
}

impl FidelityConfig {
    /// Every kind with every lead.
    #[must_use]
    pub fn ropes(&self) -> Vec<RealRope> {
        let air = self.air;
        let with = |kind: &Kind, lead_mass_kg: f64| RealRope {
            name: format!("{}, {:.0} g", kind.name, 1e3 * lead_mass_kg),
            params: RopeParams {
                links: kind.links,
                length_m: kind.length_m,
                joint_damping_nms_per_rad: kind.joint_damping_nms_per_rad,
                joint_stiffness_nm_per_rad: kind.joint_stiffness_nm_per_rad,
                radius_m: kind.radius_m,
                mass_per_length_kg_per_m: kind.mass_per_length_kg_per_m,
                lead_mass_kg,
                lead_radius_m: self.leads.radius_m,
                link_extra_scale: CYLINDER_SCALE,
            },
            extras: RopeExtras {
                air_drag: Some(AirDrag {
                    air_density_kg_m3: air.air_density_kg_m3,
                    normal_coefficient: air.normal_coefficient,
                    tangential_coefficient: air.tangential_coefficient,
                    lead_coefficient: air.lead_coefficient,
                }),
                rest_curvature_per_m: [0.0, kind.curvature_per_m, 0.0],
                mass_slope: kind.mass_slope,
            },
        };
        self.ropes
            .iter()
            .flat_map(|kind| self.leads.masses_kg.iter().map(move |m| with(kind, *m)))
            .collect()
    }
}

/// One rope compared.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FidelityRow {
    /// Kind and lead.
    pub name: String,
    /// Pearson correlation of the spectra of all points.
    pub frequency_correlation: f64,
    /// Mean distance of points of the rope per frame (m).
    pub distance_m: f64,
    /// The same of a rope of the ranges' middle (m).
    pub middle_distance_m: f64,
    /// Correlation of a rope drawn from the ranges.
    pub random_correlation: f64,
    /// Distance of that rope (m).
    pub random_distance_m: f64,
    /// Distance of the fit to the keypoints (px).
    pub residual_px: f64,
    /// Method as the estimate names it.
    pub method: String,
}

/// Keypoints of a rope, frame by frame (m).
type Paths = Vec<Vec<Vector3<f64>>>;

/// Keypoint paths of a rope in a motion.
fn paths(
    rope: &RopeParams,
    extras: RopeExtras,
    motion: &dyn AttachMotion,
    duration_s: f64,
    rate_hz: f64,
) -> Result<Paths, SimulateError> {
    let count = (duration_s * rate_hz).floor() as usize;
    let candidate = Candidate::new(rope, motion).with_extras(extras);
    let rollouts = roll_out(
        &[candidate],
        &SimOptions {
            step_s: 5e-4,
            precision: Precision::F64,
            start: Start::Equilibrium,
            frames: FrameTimes {
                first_s: 0.0,
                period_s: 1.0 / rate_hz,
                count,
            },
            watch: Watch::NOTHING,
            horizon_s: duration_s,
            threads: 1,
        },
    )?;
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

impl TrialRig {
    /// Films a rope with extras and the errors of recording `index` of `seed`.
    ///
    /// # Errors
    /// What the simulator refuses.
    pub fn film_real(&self, rope: &RealRope, seed: u64, index: u64) -> Result<Filmed, TrialError> {
        const FILM_RATE_HZ: f64 = 240.0;
        let duration_s = self.motion.duration_s();
        let paths = paths(
            &rope.params,
            rope.extras,
            &self.motion,
            duration_s,
            FILM_RATE_HZ,
        )?;
        let positions = paths
            .iter()
            .flatten()
            .flat_map(|p| p.iter().map(|x| *x as f32).collect::<Vec<f32>>())
            .collect();
        let film = RopeFilm::from_positions(rope.params, 1.0 / FILM_RATE_HZ, KEYPOINTS, positions)
            .ok_or(TrialError::EmptyFilm)?;
        let noise = self.randomisation.draw(seed, index);
        Ok(project(&film, &self.camera, &FilmTiming::default(), &noise))
    }

    /// Identifies a rope from its film and compares it in another motion.
    ///
    /// # Errors
    /// What filming, identification or the simulator refuse.
    pub fn fidelity(
        &self,
        rope: &RealRope,
        throw: &JointTrajectory,
        seed: u64,
        index: u64,
        options: &IdentifyOptions,
    ) -> Result<FidelityRow, TrialError> {
        let filmed = self.film_real(rope, seed, index)?;
        let found = self.fit(&filmed, index, options)?;
        let arm = PlannedArm::new(*throw, Pole::default());
        let moved =
            |rope: &RopeParams, extras: RopeExtras| paths(rope, extras, &arm, COMPARED_S, RATE_HZ);
        let truth = moved(&rope.params, rope.extras)?;
        let found_paths = moved(&found.params, RopeExtras::NONE)?;
        let middle = moved(&middle_rope(), RopeExtras::NONE)?;
        let random = moved(&trial_rope(seed, index), RopeExtras::NONE)?;
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
}

/// The rope of the middle of every range.
#[must_use]
pub fn middle_rope() -> RopeParams {
    RopeParams::from_array(shared_types::rope::RANGES.map(|r| f64::midpoint(r.min, r.max)))
}

fn mean_distance_m(a: &[Vec<Vector3<f64>>], b: &[Vec<Vector3<f64>>]) -> f64 {
    let pairs = a.iter().flatten().zip(b.iter().flatten());
    mean(pairs.map(|(a, b)| (a - b).norm()))
}

/// Sizes of the first harmonics of every point and axis, the mean left out.
fn spectra(paths: &[Vec<Vector3<f64>>]) -> Vec<f64> {
    let frames = paths.len() as f64;
    let points = paths.first().map_or(0, Vec::len);
    let mut out = Vec::new();
    for point in 0..points {
        for axis in 0..3 {
            for harmonic in 1..=HARMONICS {
                let turn = core::f64::consts::TAU * f64::from(harmonic) / frames;
                let (mut re, mut im) = (0.0, 0.0);
                for (i, frame) in paths.iter().enumerate() {
                    let (sin, cos) = (turn * i as f64).sin_cos();
                    re += frame[point][axis] * cos;
                    im += frame[point][axis] * sin;
                }
                out.push(re.hypot(im));
            }
        }
    }
    out
}

/// Pearson correlation of two motions' spectra.
fn spectra_correlation(a: &[Vec<Vector3<f64>>], b: &[Vec<Vector3<f64>>]) -> f64 {
    let (a, b) = (spectra(a), spectra(b));
    let (ma, mb) = (mean(a.iter().copied()), mean(b.iter().copied()));
    let pairs = || a.iter().zip(&b).map(|(x, y)| (x - ma, y - mb));
    let product: f64 = pairs().map(|(x, y)| x * y).sum();
    let squares = |f: fn((f64, f64)) -> f64| pairs().map(f).map(|v| v * v).sum::<f64>();
    product / (squares(|p| p.0) * squares(|p| p.1)).sqrt().max(1e-300)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(amplitude: f64, frequency_hz: f64) -> Vec<Vec<Vector3<f64>>> {
        (0..150)
            .map(|i| {
                let phase = core::f64::consts::TAU * frequency_hz * f64::from(i) / RATE_HZ;
                vec![Vector3::new(amplitude * phase.sin(), 0.0, 1.0)]
            })
            .collect()
    }

    #[test]
    fn spectra_agree_in_frequency_not_in_size() {
        let a = swing(1.0, 1.2);
        assert!((spectra_correlation(&a, &swing(2.0, 1.2)) - 1.0).abs() < 1e-9);
        assert!(spectra_correlation(&a, &swing(1.0, 2.4)) < 0.3);
        assert!((mean_distance_m(&a, &a)).abs() < 1e-12);
        assert!(mean_distance_m(&a, &swing(1.5, 1.2)) > 0.2);
    }

    #[test]
    fn the_configured_ropes_are_ten_and_outside_the_model() {
        let text = include_str!("../../../configs/planner/fidelity.toml");
        let ropes = toml::from_str::<FidelityConfig>(text).unwrap().ropes();
        assert_eq!(ropes.len(), 10);
        for rope in ropes {
            assert!(rope.params.validate().is_ok() && rope.params.links > 26);
            assert!(rope.extras.air_drag.is_some(), "{rope:?}");
            assert!(rope.extras.mass_slope.abs() >= 0.1, "{rope:?}");
        }
    }
}
