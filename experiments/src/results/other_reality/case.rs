//! What is drawn for one rope: the rope, how reality differs from the model, and by how much.

use super::child::OtherRope;
use super::kinds::{CONFIGURATIONS, RopeKind};
use crate::args::ChannelName;
use arm_model::kinematics::FrameMotion;
use arm_model::response::{Estimate, JointResponse, TrackingLag};
use arm_model::{ArmResponse, JOINTS, JointTrajectory, JointVector, Limits, Pole};
use nalgebra::{Vector2, Vector3};
use planner::arm_response::{FollowError, Following};
use planner::ropes::{random_strike_target, trial_rope};
use planner::synthetic::FilmNoise;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha12Rng;
use rope_sim::Sway;
use shared_types::{AirDrag, BendingFriction, RopeExtras, RopeParams};
use std::f64::consts::TAU;

/// Keeps these ropes apart from those of other studies.
const SALT: u64 = 0x6f74_6872;
/// And those of the paper's ropes.
const PAPER_SALT: u64 = 0x7061_7065;
/// Distance at which the camera looks at the rope (m).
const CAMERA_DEPTH_M: f64 = 1.0;

/// The arm as it is.
#[derive(Debug, Clone)]
pub(super) struct RealArm {
    /// Where its joints are, minus what they report.
    zeros_rad: JointVector,
    /// How late each joint follows slow motion; none for an arm that does as it is told.
    delays_s: Option<[f64; JOINTS]>,
}

impl RealArm {
    /// What the joints report when a trajectory is commanded.
    pub fn reported(&self, command: &JointTrajectory) -> Result<JointTrajectory, FollowError> {
        const DAMPING_RATIO: f64 = 0.9;
        let Some(delays_s) = self.delays_s else {
            return Ok(*command);
        };
        let known = |value: f64| Estimate {
            value,
            interval: [value, value],
        };
        let response = ArmResponse {
            version: shared_types::VERSION.to_owned(),
            source: "drawn".to_owned(),
            command_to_target_s: None,
            excitation: None,
            joints: delays_s.map(|delay_s| {
                JointResponse::Excited(TrackingLag {
                    dead_time_s: known(0.0),
                    natural_frequency_hz: known(2.0 * DAMPING_RATIO / (TAU * delay_s)),
                    damping_ratio: known(DAMPING_RATIO),
                    residual_rad: 0.0,
                    samples: 1,
                })
            }),
        };
        Following::new(&response, &Limits::default()).motion(command)
    }

    /// Where the attach frame really is while the joints report this.
    pub fn attach_frame(&self, reported: &JointTrajectory, time_s: f64) -> FrameMotion {
        let mut state = reported.state_at(time_s);
        state.q = state.q + self.zeros_rad;
        Pole::default().attach_motion(&state)
    }
}

/// One rope in one reality.
#[derive(Debug, Clone)]
pub(super) struct Case {
    pub rope: OtherRope,
    pub target_m: [f64; 3],
    pub arm: RealArm,
    /// Errors of the film.
    pub film: FilmNoise,
    /// Seed of what is left to chance in MuJoCo.
    pub seed: u64,
}

impl Case {
    /// Rope `index` of `seed` with one channel, or all, of so many links for each of its own.
    pub fn draw(seed: u64, index: u64, channel: ChannelName, refinement: u32) -> Self {
        let trial = ((SALT ^ seed) << 32) ^ index;
        let mut rng = ChaCha12Rng::seed_from_u64(trial);
        let params = rope(seed, index, &mut rng);
        Self::of(trial, rng, params, (channel, refinement))
    }

    /// Case `index` of the paper's ropes and configurations, kind by kind, with all channels.
    pub fn of_paper(seed: u64, index: u64, refinement: u32) -> (RopeKind, (f64, f64), Self) {
        let kinds = RopeKind::ALL.len() as u64;
        let kind = RopeKind::ALL[(index % kinds) as usize];
        let configuration = CONFIGURATIONS[(index / kinds) as usize % CONFIGURATIONS.len()];
        let trial = ((PAPER_SALT ^ seed) << 32) ^ index;
        let mut rng = ChaCha12Rng::seed_from_u64(trial);
        let params = kind.rope(configuration, &mut rng);
        let case = Self::of(trial, rng, params, (ChannelName::All, refinement));
        (kind, configuration, case)
    }

    /// What a channel draws does not depend on which of them are asked for.
    fn of(
        trial: u64,
        mut rng: ChaCha12Rng,
        params: RopeParams,
        (channel, refinement): (ChannelName, u32),
    ) -> Self {
        let mut uniform = |low: f64, high: f64| rng.random_range(low..=high);
        let mut direction = || {
            let angle = uniform(0.0, TAU);
            Vector2::new(angle.cos(), angle.sin())
        };
        let (curved, tilted, swung) = (direction(), direction(), direction());
        let camera = [direction(), direction(), direction()];
        let friction = BendingFriction {
            moment_max_nm: uniform(0.02, 0.2) * bending_moment_nm(&params, uniform(0.1, 0.3)),
            slip_curvature_per_m: uniform(0.2, 1.5),
        };
        let curvature = curved * uniform(0.2, 0.6);
        let sway = {
            let (phase, rate) = (uniform(0.0, TAU), pendulum_rad_s(&params));
            let long = swung * uniform(1.0, 4.0).to_radians();
            let short = Vector2::new(-long.y, long.x) * uniform(0.0, 0.5);
            Sway {
                angle_rad: (long * phase.cos() + short * phase.sin()).into(),
                rate_rad_s: ((short * phase.cos() - long * phase.sin()) * rate).into(),
            }
        };
        let air_drag = AirDrag {
            air_density_kg_m3: 1.2,
            normal_coefficient: uniform(0.9, 1.3),
            tangential_coefficient: 0.02,
            lead_coefficient: 0.5,
        };
        let delays_s = core::array::from_fn(|_| uniform(0.010, 0.022));
        let zeros_rad = JointVector(core::array::from_fn(|_| {
            let side = if uniform(0.0, 1.0) < 0.5 { -1.0 } else { 1.0 };
            side * 0.2_f64.to_radians()
        }));
        let film = FilmNoise {
            longitudinal_px: 0.3,
            lateral_px: 0.2,
            correlation: 0.8,
            rope_width_px: uniform(-0.5, 0.5),
            lead_width_px: uniform(-0.5, 0.5),
            seed: rng.random(),
            ..FilmNoise::default()
        };
        let hangs = rng.random();
        let has = |one: ChannelName| channel == one || channel == ChannelName::All;
        let optional =
            |one: ChannelName, pair: Vector2<f64>| if has(one) { pair } else { Vector2::zeros() };
        let curvature = optional(ChannelName::Curvature, curvature);
        let extras = RopeExtras {
            rest_curvature_per_m: [curvature.x, curvature.y, 0.0],
            air_drag: has(ChannelName::Drag).then_some(air_drag),
            friction: has(ChannelName::Friction).then_some(friction),
            ..RopeExtras::NONE
        };
        let joints = has(ChannelName::Joints);
        Self {
            rope: OtherRope {
                params: params.with_extras(extras),
                refinement,
                clamp_tilt_rad: optional(ChannelName::ClampTilt, tilted * 1_f64.to_radians())
                    .into(),
                sway: if has(ChannelName::Sway) {
                    sway
                } else {
                    Sway::NONE
                },
            },
            target_m: random_strike_target(trial),
            arm: RealArm {
                zeros_rad: if joints {
                    zeros_rad
                } else {
                    JointVector::splat(0.0)
                },
                delays_s: joints.then_some(delays_s),
            },
            film: if has(ChannelName::Camera) {
                misplaced(film, camera)
            } else {
                film
            },
            seed: hangs,
        }
    }
}

/// Half of the ropes are of the ranges; the others are thin and soft, as a cord is.
fn rope(seed: u64, index: u64, rng: &mut ChaCha12Rng) -> RopeParams {
    let of_ranges = trial_rope(SALT ^ seed, index);
    let mut within = |low: f64, high: f64| rng.random_range(low.ln()..=high.ln()).exp();
    let thin = RopeParams {
        joint_stiffness_nm_per_rad: within(0.015, 0.05),
        joint_damping_nms_per_rad: within(0.0004, 0.002),
        radius_m: within(0.002, 0.004),
        mass_per_length_kg_per_m: within(0.02, 0.05),
        lead_mass_kg: within(0.02, 0.06),
        ..of_ranges
    };
    if index.is_multiple_of(2) {
        of_ranges
    } else {
        thin
    }
}

/// Frequency of the rope as a stiff pendulum: about that of its slowest swing (rad/s).
fn pendulum_rad_s(rope: &RopeParams) -> f64 {
    let rope_kg = rope.mass_per_length_kg_per_m * rope.length_m;
    let moment = rope.lead_mass_kg + rope_kg / 2.0;
    let inertia = (rope.lead_mass_kg + rope_kg / 3.0) * rope.length_m;
    (9.81 * moment / inertia).sqrt()
}

/// Elastic moment at a clamp that is turned by `angle_rad` against the rope's weight (N m): that
/// of a tensioned beam.
fn bending_moment_nm(rope: &RopeParams, angle_rad: f64) -> f64 {
    let rope_kg = rope.mass_per_length_kg_per_m * rope.length_m;
    let weight_n = 9.81 * (rope.lead_mass_kg + rope_kg);
    angle_rad * (rope.bending_stiffness_nm2() * weight_n).sqrt()
}

/// A film whose camera stands 5 mm and looks half a degree off.
fn misplaced(film: FilmNoise, [a, b, aim]: [Vector2<f64>; 3]) -> FilmNoise {
    let shift_m = 0.005 * Vector3::new(a.x, a.y * b.x, a.y * b.y);
    // The camera looks along y.
    let aside_m = CAMERA_DEPTH_M * 0.5_f64.to_radians().tan();
    FilmNoise {
        camera_shift_m: shift_m,
        lookat_shift_m: shift_m + aside_m * Vector3::new(aim.x, 0.0, aim.y),
        ..film
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_is_drawn_alike_alone_and_with_all() {
        let alone = |channel| Case::draw(1, 3, channel, 2);
        let all = alone(ChannelName::All);
        let friction = |case: &Case| case.rope.params.beyond().friction;
        assert_eq!(friction(&alone(ChannelName::Friction)), friction(&all));
        assert_eq!(friction(&alone(ChannelName::Sway)), None);
        assert_eq!(alone(ChannelName::Camera).film, all.film);
        let plain = all.rope.params.with_extras(RopeExtras::NONE);
        assert_eq!(alone(ChannelName::None).rope.params, plain);
        assert_eq!(alone(ChannelName::None).arm.zeros_rad.max_abs(), 0.0);
        assert_ne!(Case::draw(2, 3, ChannelName::All, 2).film, all.film);
    }
}
