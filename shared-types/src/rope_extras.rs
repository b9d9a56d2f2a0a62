//! What a rope may have beyond the paper's nine parameters: air drag, a rest curvature,
//! mass that is uneven along it, dry friction in bending and a clamp of its own. Off by
//! default.

use serde::{Deserialize, Serialize};

/// Drag of still air on the links and the lead, quadratic in the speed.
///
/// A link of length s and radius r feels `1/2 rho 2 r s (c_n |v_n| v_n + c_t |v_t| v_t)`
/// against its centre's velocity, split into parts across and along the link; the
/// lead `1/2 rho pi r_L² c_L |v| v`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AirDrag {
    /// Density of the air (kg/m³), about 1.2.
    pub air_density_kg_m3: f64,
    /// Coefficient across a link, on its diameter times length (1), about 1.1.
    pub normal_coefficient: f64,
    /// Coefficient along a link, on the same area (1), about 0.02.
    pub tangential_coefficient: f64,
    /// Coefficient of the lead, on its cross section (1), about 0.5.
    pub lead_coefficient: f64,
}

/// Dry friction between a rope's strands: hysteresis in bending.
///
/// Dahl's model (1968) in every joint: its moment z follows the joint's turning at the rate
/// w as `dz/dt = sigma (w - |w| z / z_max)`. It starts as a spring, slips as it nears z_max,
/// and holds where the joint stands still. With the greatest moment and the curvature per
/// length given, the motion hardly depends on the number of links.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BendingFriction {
    /// Greatest moment z_max (N m).
    pub moment_max_nm: f64,
    /// Change of curvature over which it comes up, `z_max / (sigma s)` (rad/m).
    pub slip_curvature_per_m: f64,
}

/// Physics of a rope beyond its nine parameters. TOML form: table `extras` of `rope.toml`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RopeExtras {
    /// Curvature of the unloaded rope (rad/m), a rotation vector per length in the
    /// link's frame, the same all along: every joint, the first included, rests
    /// turned by `exp(curvature s)`. Zero is a straight rope.
    pub rest_curvature_per_m: [f64; 3],
    /// Unevenness of the rope's mass: mass per length goes in a straight line from
    /// `1 - mass_slope` times its mean at the clamp to `1 + mass_slope` times at the free
    /// end, from -0.95 to 0.95. Zero is an even rope. Sizes and the links' inertia about
    /// their centres stay.
    pub mass_slope: f64,
    /// Stiffness, damping and friction of the first joint, as a multiple of the others' (1). A rope
    /// clamped rigidly bends along the half link on the clamp's far side only: about 2 in
    /// the limit of a continuous rope, less in a clamp that gives.
    pub clamp_stiffness: f64,
    /// Drag of still air; `None` is vacuum, as in the paper.
    pub air_drag: Option<AirDrag>,
    /// Dry friction in bending; `None` is a rope without.
    pub friction: Option<BendingFriction>,
}

impl RopeExtras {
    /// The plain rope of nine parameters.
    pub const NONE: Self = Self {
        air_drag: None,
        rest_curvature_per_m: [0.0; 3],
        mass_slope: 0.0,
        clamp_stiffness: 1.0,
        friction: None,
    };

    /// Mass of a link, counted from the clamp, as a multiple of the mean of `links` of them.
    #[must_use]
    pub fn mass_factor(&self, link: u32, links: u32) -> f64 {
        let place = (f64::from(link) + 0.5) / f64::from(links);
        1.0 + self.mass_slope * (2.0 * place - 1.0)
    }

    /// Every number with its key in `rope.toml`, least and greatest value.
    pub(crate) fn numbers(&self) -> [(&'static str, f64, f64, f64); 11] {
        let drag = self.air_drag.map_or([0.0; 4], |drag| {
            [
                drag.air_density_kg_m3,
                drag.normal_coefficient,
                drag.tangential_coefficient,
                drag.lead_coefficient,
            ]
        });
        let friction = self.friction.map_or([0.0, 1.0], |friction| {
            [friction.moment_max_nm, friction.slip_curvature_per_m]
        });
        let [x, y, z] = self.rest_curvature_per_m;
        [
            ("extras.rest_curvature_per_m", x, -1e3, 1e3),
            ("extras.rest_curvature_per_m", y, -1e3, 1e3),
            ("extras.rest_curvature_per_m", z, -1e3, 1e3),
            ("extras.mass_slope", self.mass_slope, -0.95, 0.95),
            ("extras.clamp_stiffness", self.clamp_stiffness, 0.01, 100.0),
            ("extras.air_drag.air_density_kg_m3", drag[0], 0.0, 1e4),
            ("extras.air_drag.normal_coefficient", drag[1], 0.0, 1e4),
            ("extras.air_drag.tangential_coefficient", drag[2], 0.0, 1e4),
            ("extras.air_drag.lead_coefficient", drag[3], 0.0, 1e4),
            ("extras.friction.moment_max_nm", friction[0], 0.0, 10.0),
            (
                "extras.friction.slip_curvature_per_m",
                friction[1],
                1e-3,
                1e3,
            ),
        ]
    }
}

impl Default for RopeExtras {
    fn default() -> Self {
        Self::NONE
    }
}
