//! What a rope may have beyond the paper's nine parameters: air drag, a rest curvature
//! and mass that is uneven along it. Off by default.

use crate::error::refuse_unless;

/// Drag of still air on the links and the lead, quadratic in the speed.
///
/// A link of length s and radius r feels `1/2 rho 2 r s (c_n |v_n| v_n + c_t |v_t| v_t)`
/// against its centre's velocity, split into parts across and along the link; the
/// lead `1/2 rho pi r_L² c_L |v| v`.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// Physics of a rope beyond its nine parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RopeExtras {
    /// Drag of still air; `None` is vacuum, as in the paper.
    pub air_drag: Option<AirDrag>,
    /// Curvature of the unloaded rope (rad/m), a rotation vector per length in the
    /// link's frame, the same all along: every joint, the first included, rests
    /// turned by `exp(curvature s)`. Zero is a straight rope.
    pub rest_curvature_per_m: [f64; 3],
    /// Unevenness of the rope's mass: mass per length goes in a straight line from
    /// `1 - mass_slope` times its mean at the clamp to `1 + mass_slope` times at the free
    /// end, from -0.95 to 0.95. Zero is an even rope. Sizes and the links' inertia about
    /// their centres stay.
    pub mass_slope: f64,
}

impl RopeExtras {
    /// The plain rope of nine parameters.
    pub const NONE: Self = Self {
        air_drag: None,
        rest_curvature_per_m: [0.0; 3],
        mass_slope: 0.0,
    };

    /// Whether this is the plain rope of nine parameters.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// Mass of a link, counted from the clamp, as a multiple of the mean of `links` of them.
    pub(crate) fn mass_factor(&self, link: u32, links: u32) -> f64 {
        let place = (f64::from(link) + 0.5) / f64::from(links);
        1.0 + self.mass_slope * (2.0 * place - 1.0)
    }

    pub(crate) fn check(&self) -> Result<(), String> {
        let curvature = self.rest_curvature_per_m;
        let need = "must be a number of at most 1000 rad/m";
        refuse_unless("rest_curvature_per_m", need, curvature, |v| v.abs() <= 1e3)?;
        let need = "must be from -0.95 to 0.95";
        refuse_unless("mass_slope", need, [self.mass_slope], |v| v.abs() <= 0.95)?;
        let Some(drag) = self.air_drag else {
            return Ok(());
        };
        for (field, number) in [
            ("air_density_kg_m3", drag.air_density_kg_m3),
            ("normal_coefficient", drag.normal_coefficient),
            ("tangential_coefficient", drag.tangential_coefficient),
            ("lead_coefficient", drag.lead_coefficient),
        ] {
            let need = "must be from 0 to 10 000";
            refuse_unless(field, need, [number], |v| (0.0..=1e4).contains(&v))?;
        }
        Ok(())
    }
}

impl Default for RopeExtras {
    fn default() -> Self {
        Self::NONE
    }
}
