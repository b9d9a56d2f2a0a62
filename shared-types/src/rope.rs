//! The nine rope parameters (the paper's ξ) with their ranges.

use crate::rope_extras::RopeExtras;
use crate::rope_state::Sway;
use arm_model::unit_hint;
use serde::{Deserialize, Serialize};

/// Number of rope parameters.
pub const ROPE_PARAMETERS: usize = 9;

/// Rope parameters, the paper's ξ, and what a rope has beyond them. TOML form: `rope.toml`,
/// keys as the fields.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RopeParams {
    /// Number of rigid links N.
    pub links: u32,
    /// Rope length L, attach point to lead centre (m).
    pub length_m: f64,
    /// Damping c of each ball joint (N m s/rad).
    pub joint_damping_nms_per_rad: f64,
    /// Stiffness k of each ball joint (N m/rad).
    pub joint_stiffness_nm_per_rad: f64,
    /// Rope radius, also its collision radius (m).
    pub radius_m: f64,
    /// Mass per length µ (kg/m).
    pub mass_per_length_kg_per_m: f64,
    /// Mass of the lead at the free end (kg).
    pub lead_mass_kg: f64,
    /// Radius of the lead (m).
    pub lead_radius_m: f64,
    /// Scale e of the link's inertia radius, `R_I = max(e s/2, r)` (1).
    pub link_extra_scale: f64,
    /// Physics beyond these nine; `None` for none.
    #[serde(default)]
    pub extras: Option<RopeExtras>,
}

/// Key, smallest and largest value of one parameter over which networks are
/// trained and fits search (paper, table of in-domain results).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterRange {
    /// Key in `rope.toml`.
    pub key: &'static str,
    /// Short name for tables.
    pub label: &'static str,
    /// Unit for tables.
    pub unit: &'static str,
    /// Lower end of the range.
    pub min: f64,
    /// Upper end of the range.
    pub max: f64,
}

const fn range(
    key: &'static str,
    label: &'static str,
    unit: &'static str,
    min: f64,
    max: f64,
) -> ParameterRange {
    ParameterRange {
        key,
        label,
        unit,
        min,
        max,
    }
}

/// Ranges in the order of [`RopeParams::to_array`].
pub const RANGES: [ParameterRange; ROPE_PARAMETERS] = [
    range("links", "links", "", 20.0, 26.0),
    range("length_m", "length", "m", 0.45, 0.65),
    range(
        "joint_damping_nms_per_rad",
        "joint damping",
        "N m s/rad",
        0.001,
        0.05,
    ),
    range(
        "joint_stiffness_nm_per_rad",
        "joint stiffness",
        "N m/rad",
        0.05,
        1.0,
    ),
    range("radius_m", "rope radius", "m", 0.003, 0.015),
    range(
        "mass_per_length_kg_per_m",
        "mass per length",
        "kg/m",
        0.02,
        0.12,
    ),
    range("lead_mass_kg", "lead mass", "kg", 0.02, 0.12),
    range("lead_radius_m", "lead radius", "m", 0.015, 0.045),
    range("link_extra_scale", "link extra scale", "", 0.5, 1.2),
];

/// Why a rope description is refused: a value is NaN, infinite, or not physical.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("rope parameter `{key}` is {value}, but must be a finite number from {min} to {max}{}", unit_hint(key, *value, *max))]
pub struct RopeError {
    key: &'static str,
    value: f64,
    min: f64,
    max: f64,
}

impl RopeError {
    /// Refuses a value that is not from `min` to `max`.
    fn unless_within(key: &'static str, value: f64, min: f64, max: f64) -> Result<(), Self> {
        let refusal = Self {
            key,
            value,
            min,
            max,
        };
        (value >= min && value <= max).then_some(()).ok_or(refusal)
    }
}

/// Most links a rope may have anywhere in the system.
const MAX_LINKS: u32 = 200;

/// Physical bounds the simulator accepts, wider than [`RANGES`].
const PHYSICAL: [(f64, f64); ROPE_PARAMETERS] = [
    (1.0, MAX_LINKS as f64),
    (0.01, 10.0),
    (0.0, 10.0),
    (0.0, 100.0),
    (1e-5, 0.1),
    (1e-4, 10.0),
    (0.0, 10.0),
    (1e-4, 0.5),
    (0.05, 10.0),
];

impl RopeParams {
    /// The nine values in the order of [`RANGES`].
    #[must_use]
    pub fn to_array(&self) -> [f64; ROPE_PARAMETERS] {
        [
            f64::from(self.links),
            self.length_m,
            self.joint_damping_nms_per_rad,
            self.joint_stiffness_nm_per_rad,
            self.radius_m,
            self.mass_per_length_kg_per_m,
            self.lead_mass_kg,
            self.lead_radius_m,
            self.link_extra_scale,
        ]
    }

    /// From nine values in the order of [`RANGES`], without extras; links are rounded.
    #[must_use]
    pub fn from_array(v: [f64; ROPE_PARAMETERS]) -> Self {
        Self {
            links: v[0].round() as u32,
            length_m: v[1],
            joint_damping_nms_per_rad: v[2],
            joint_stiffness_nm_per_rad: v[3],
            radius_m: v[4],
            mass_per_length_kg_per_m: v[5],
            lead_mass_kg: v[6],
            lead_radius_m: v[7],
            link_extra_scale: v[8],
            extras: None,
        }
    }

    /// Refuses the first value that is not finite or not physical.
    pub fn validate(&self) -> Result<(), RopeError> {
        for ((value, (min, max)), range) in self.to_array().into_iter().zip(PHYSICAL).zip(RANGES) {
            RopeError::unless_within(range.key, value, min, max)?;
        }
        for (key, value, min, max) in self.beyond().numbers() {
            RopeError::unless_within(key, value, min, max)?;
        }
        Ok(())
    }

    /// Keys of parameters outside the trained ranges [`RANGES`].
    pub fn outside_ranges(&self) -> impl Iterator<Item = &'static str> {
        self.to_array()
            .into_iter()
            .zip(RANGES)
            .filter(|(v, r)| !(*v >= r.min && *v <= r.max))
            .map(|(_, r)| r.key)
    }

    /// Length of one link (m).
    #[must_use]
    pub fn link_length_m(&self) -> f64 {
        self.length_m / f64::from(self.links)
    }

    /// Bending stiffness `k s` (N m²).
    #[must_use]
    pub fn bending_stiffness_nm2(&self) -> f64 {
        self.joint_stiffness_nm_per_rad * self.link_length_m()
    }

    /// Mass of one link (kg).
    #[must_use]
    pub fn link_mass_kg(&self) -> f64 {
        self.mass_per_length_kg_per_m * self.link_length_m()
    }

    /// Moment of inertia of one link about its centre, isotropic (kg m²).
    #[must_use]
    pub fn link_inertia_kg_m2(&self) -> f64 {
        let radius = (self.link_extra_scale * self.link_length_m() / 2.0).max(self.radius_m);
        0.4 * self.link_mass_kg() * radius * radius
    }

    /// Moment of inertia of the lead about its centre (kg m²).
    #[must_use]
    pub fn lead_inertia_kg_m2(&self) -> f64 {
        0.4 * self.lead_mass_kg * self.lead_radius_m * self.lead_radius_m
    }

    /// The rope's physics beyond its nine parameters.
    #[must_use]
    pub fn beyond(&self) -> RopeExtras {
        self.extras.unwrap_or(RopeExtras::NONE)
    }

    /// The same rope with other physics beyond its nine parameters.
    #[must_use]
    pub fn with_extras(self, extras: RopeExtras) -> Self {
        let extras = (extras != RopeExtras::NONE).then_some(extras);
        Self { extras, ..self }
    }

    /// Stiffness that dry friction adds to a joint until it slips (N m/rad).
    #[must_use]
    pub fn friction_stiffness_nm_per_rad(&self) -> f64 {
        self.beyond().friction.map_or(0.0, |friction| {
            friction.moment_max_nm / (friction.slip_curvature_per_m * self.link_length_m())
        })
    }
}

/// Link counts of [`RANGES`].
pub const LINK_COUNTS: usize = 7;

/// A combination of parameters that an observation cannot tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ambiguity {
    /// Unit vector over the parameters in the order of [`RANGES`], each in deviations
    /// of its range.
    pub direction: [f64; ROPE_PARAMETERS],
    /// Part of the prior's deviation that is left along it (0 to 1, or a little above).
    pub kept: f64,
}

/// What an observation and the parameter ranges say about a rope together. All arrays
/// are in the order of [`RANGES`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RopePosterior {
    /// Means.
    pub mean: [f64; ROPE_PARAMETERS],
    /// Covariance.
    pub covariance: [[f64; ROPE_PARAMETERS]; ROPE_PARAMETERS],
    /// Intervals that hold the truth with a probability of 90 %.
    pub interval_90: [[f64; 2]; ROPE_PARAMETERS],
    /// Probability of each link count of the ranges, the smallest first.
    pub links_probability: [f64; LINK_COUNTS],
    /// What cannot be told apart, the least known first.
    pub ambiguities: Vec<Ambiguity>,
    /// Factor by which variances were widened because parts of the film disagree.
    pub inflation: f64,
    /// Root mean square distance of the film's keypoints from the fitted rope, at its depth
    /// (m): the tracker's noise, and what the model does not explain.
    #[serde(default)]
    pub residual_m: f64,
    /// What the fit seems to have put into the camera's place or the length instead (m).
    #[serde(default)]
    pub absorbed_m: f64,
}

/// Noise of the keypoints in one direction, as found.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct KeypointNoise {
    /// Standard deviation (px).
    pub sigma_px: f64,
    /// Correlation from frame to frame.
    pub in_time: f64,
    /// Correlation from keypoint to keypoint.
    pub along_rope: f64,
}

/// What the fit says beside the rope.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FitCircumstances {
    /// Noise along the rope.
    pub noise_along: KeypointNoise,
    /// Noise across the rope.
    pub noise_across: KeypointNoise,
    /// Correction of the camera's position in the world (m).
    pub camera_position_m: [f64; 3],
    /// Correction of the camera's attitude, a rotation vector in its own frame (rad).
    pub camera_rotation_rad: [f64; 3],
    /// Swing of the rope at the first frame.
    #[serde(default)]
    pub sway: Sway,
}

/// How far a rope is from those the ranges know.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutOfDistribution {
    /// Score: about how many deviations the rope is outside.
    pub score: f64,
    /// Score from which it counts as outside.
    pub limit: f64,
    /// What speaks for it; empty below the limit.
    pub reasons: Vec<String>,
}

impl OutOfDistribution {
    /// Whether the rope is not one of those the ranges know.
    #[must_use]
    pub fn is_flagged(&self) -> bool {
        self.score >= self.limit
    }
}

/// An identified rope with its uncertainty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RopeEstimate {
    /// Best parameters.
    pub params: RopeParams,
    /// One standard deviation per parameter, order of [`RANGES`]; `None` where
    /// the observation says nothing about it.
    pub std_dev: [Option<f64>; ROPE_PARAMETERS],
    /// Root mean square distance between observed and simulated keypoints (px).
    pub residual_px: f64,
    /// Method that made it: `cmaes`; `hybrid-search` or `hybrid-network` after what
    /// proposed the start; `hybrid-wide` if the rope is outside the ranges; `network`.
    pub method: heapless::String<16>,
    /// Simulations used.
    pub simulations: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Offset added to the joint motion's clock to match the camera's (s).
    pub time_offset_s: f64,
    /// Everything that is known about the parameters.
    pub posterior: RopePosterior,
    /// Noise and camera as the fit found them.
    pub circumstances: FitCircumstances,
    /// Whether the rope is one of those the ranges know.
    pub out_of_distribution: OutOfDistribution,
    /// What speaks against relying on it, each with what to do.
    #[serde(default)]
    pub warnings: Vec<String>,
}

impl RopeEstimate {
    /// Whether nothing speaks against relying on it.
    #[must_use]
    pub const fn is_reliable(&self) -> bool {
        self.warnings.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rope_extras::BendingFriction;

    #[test]
    fn array_form_keeps_every_field() {
        let v = [23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0];
        assert_eq!(RopeParams::from_array(v).to_array(), v);
        assert!(RopeParams::from_array(v).validate().is_ok());
        assert_eq!(RopeParams::from_array(v).outside_ranges().count(), 0);
    }

    #[test]
    fn every_field_is_checked_by_name() {
        for (i, range) in RANGES.iter().enumerate() {
            for bad in [f64::NAN, -1.0, 1e9] {
                let mut v = [23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0];
                v[i] = bad;
                let rope = RopeParams::from_array(v);
                assert_eq!(rope.validate().unwrap_err().key, range.key);
            }
        }
    }

    fn rope() -> RopeParams {
        RopeParams::from_array([23.0, 0.55, 0.006, 0.15, 0.0055, 0.05, 0.05, 0.02, 1.0])
    }

    #[test]
    fn extras_are_checked_by_name_and_none_is_left_out() {
        assert_eq!(rope().with_extras(RopeExtras::NONE), rope());
        let slope = RopeExtras {
            mass_slope: 1.0,
            ..RopeExtras::NONE
        };
        let refusal = rope().with_extras(slope).validate().unwrap_err();
        assert!(
            refusal.to_string().contains("extras.mass_slope"),
            "{refusal}"
        );
        let friction = BendingFriction {
            moment_max_nm: f64::NAN,
            slip_curvature_per_m: 0.5,
        };
        let extras = RopeExtras {
            friction: Some(friction),
            ..RopeExtras::NONE
        };
        assert!(rope().with_extras(extras).validate().is_err());
    }

    #[test]
    fn a_rope_file_without_extras_reads_as_before_and_one_with_them_comes_back() {
        let plain = toml::to_string(&rope()).unwrap();
        assert!(!plain.contains("extras"));
        assert_eq!(toml::from_str::<RopeParams>(&plain).unwrap(), rope());
        let extras = RopeExtras {
            rest_curvature_per_m: [0.3, -0.2, 0.0],
            friction: Some(BendingFriction {
                moment_max_nm: 0.002,
                slip_curvature_per_m: 0.5,
            }),
            ..RopeExtras::NONE
        };
        let curled = rope().with_extras(extras);
        let text = toml::to_string(&curled).unwrap();
        assert_eq!(toml::from_str::<RopeParams>(&text).unwrap(), curled);
        let bytes = postcard::to_allocvec(&curled).unwrap();
        assert_eq!(postcard::from_bytes::<RopeParams>(&bytes).unwrap(), curled);
    }
}
