//! The paper's test ropes: five kinds in six configurations (its table of full pipeline results).

use rand::RngExt;
use rand_chacha::ChaCha12Rng;
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;

/// Kinds of rope, by the paper's names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RopeKind {
    /// Twine: slack, hardly damped.
    Brown,
    /// Cotton: stiff, damped.
    Yellow,
    /// Cotton: slack, hardly damped.
    Red,
    /// Polyester: stiff, much damped.
    Orange,
    /// Steel: few heavy links, next to no stiffness. Outside the ranges.
    Chain,
}

/// What a kind of rope is made of. Mass per length and radius are the paper's, which tells
/// stiffness and damping in words only.
struct Material {
    links: u32,
    mass_per_length_kg_per_m: f64,
    radius_m: f64,
    bending_stiffness_nm2: f64,
    /// Damping of a joint by its stiffness (s).
    retardation_s: f64,
}

/// Length (m) and lead's mass (kg).
pub(super) const CONFIGURATIONS: [(f64, f64); 6] = [
    (0.45, 0.005),
    (0.45, 0.010),
    (0.45, 0.020),
    (0.45, 0.030),
    (0.55, 0.005),
    (0.65, 0.005),
];

/// Radius of every lead (m).
const LEAD_RADIUS_M: f64 = 0.015;
/// Stiffness, damping and mass of a rope differ from its kind's by up to so much.
const SPREAD: f64 = 0.2;

impl RopeKind {
    pub const ALL: [Self; 5] = [
        Self::Brown,
        Self::Yellow,
        Self::Red,
        Self::Orange,
        Self::Chain,
    ];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Brown => "brown twine",
            Self::Yellow => "yellow cotton",
            Self::Red => "red cotton",
            Self::Orange => "orange polyester",
            Self::Chain => "chain",
        }
    }

    const fn material(self) -> Material {
        let (links, mass_per_length_kg_per_m, radius_m, bending_stiffness_nm2, retardation_s) =
            match self {
                Self::Brown => (23, 0.013, 0.006, 4e-4, 0.02),
                Self::Yellow => (23, 0.011, 0.005, 2e-3, 0.03),
                Self::Red => (23, 0.033, 0.0095, 1e-3, 0.02),
                Self::Orange => (23, 0.082, 0.0127, 1e-2, 0.04),
                Self::Chain => (16, 0.52, 0.009, 2e-5, 0.02),
            };
        Material {
            links,
            mass_per_length_kg_per_m,
            radius_m,
            bending_stiffness_nm2,
            retardation_s,
        }
    }

    /// A rope of this kind, of so long a length (m) and with such a lead (kg).
    pub fn rope(self, (length_m, lead_mass_kg): (f64, f64), rng: &mut ChaCha12Rng) -> RopeParams {
        let material = self.material();
        let mut about = |value: f64| value * (1.0 + rng.random_range(-SPREAD..=SPREAD));
        let link_m = length_m / f64::from(material.links);
        let stiffness_nm_per_rad = about(material.bending_stiffness_nm2) / link_m;
        RopeParams {
            links: material.links,
            length_m,
            joint_damping_nms_per_rad: about(material.retardation_s) * stiffness_nm_per_rad,
            joint_stiffness_nm_per_rad: stiffness_nm_per_rad,
            radius_m: material.radius_m,
            mass_per_length_kg_per_m: about(material.mass_per_length_kg_per_m),
            lead_mass_kg,
            lead_radius_m: LEAD_RADIUS_M,
            link_extra_scale: 0.5,
            extras: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn every_kind_in_every_configuration_can_be_simulated() {
        let mut rng = ChaCha12Rng::seed_from_u64(1);
        for kind in RopeKind::ALL {
            for configuration in CONFIGURATIONS {
                let rope = kind.rope(configuration, &mut rng);
                rope.validate().unwrap();
                assert_eq!((rope.length_m, rope.lead_mass_kg), configuration);
                let stiffness =
                    rope.bending_stiffness_nm2() / kind.material().bending_stiffness_nm2;
                assert!(
                    (stiffness - 1.0).abs() <= SPREAD + 1e-9,
                    "{kind:?}: {stiffness}"
                );
            }
        }
    }
}
