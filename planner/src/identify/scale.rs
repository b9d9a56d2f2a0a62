//! The factor that no camera sees.
//!
//! Multiplying stiffness, damping and both masses by one factor changes no
//! motion. Given their ratios and independent uniform priors over the parameter
//! ranges, the mass per length µ has the density `µ³` on the interval in which
//! all four stay in their ranges (`k = α µ`, `c = β µ`, `m_L = γ µ`: the change of
//! variables contributes µ³). Its median minimises the mean absolute error.

use super::coordinates::parameter::{DAMPING, LEAD_MASS, MASS_PER_LENGTH, STIFFNESS};
use shared_types::rope::RANGES;

/// Median of the mass per length (kg/m) for the ratios `[k/µ, c/µ, m_L/µ]`. For ratios
/// that no rope of the ranges has, it breaks the ranges least, by equal factors at both
/// ends.
#[must_use]
pub fn median_mass_per_length(ratios: [f64; 3]) -> f64 {
    let (low, high) = bounds(ratios);
    if low < high {
        ((low.powi(4) + high.powi(4)) / 2.0).powf(0.25)
    } else {
        (low * high).sqrt()
    }
}

/// A mass per length drawn for given ratios.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DrawnMass {
    /// Mass per length (kg/m).
    pub(super) mass_per_length: f64,
    /// Prior density of the ratios' logarithms, up to one factor; 0 if no rope of the
    /// ranges has them.
    pub(super) density: f64,
}

/// The mass per length at the quantile `part` (0 to 1) of its density for the
/// ratios `[k/µ, c/µ, m_L/µ]`, or that of a lead that was weighed.
pub(super) fn draw(lead_mass_kg: Option<f64>, ratios: [f64; 3], part: f64) -> DrawnMass {
    if let Some(lead_mass_kg) = lead_mass_kg {
        let mass_per_length = lead_mass_kg / ratios[2];
        let inside = |i: usize, value: f64| value >= RANGES[i].min && value <= RANGES[i].max;
        let possible = inside(MASS_PER_LENGTH, mass_per_length)
            && inside(STIFFNESS, ratios[0] * mass_per_length)
            && inside(DAMPING, ratios[1] * mass_per_length);
        let density = ratios[0] * ratios[1] * mass_per_length.powi(3);
        return DrawnMass {
            mass_per_length,
            density: if possible { density } else { 0.0 },
        };
    }
    let (low, high) = bounds(ratios);
    if low < high {
        let (a, b) = (low.powi(4), high.powi(4));
        DrawnMass {
            mass_per_length: (a + part * (b - a)).powf(0.25),
            density: ratios.iter().product::<f64>() * (b - a),
        }
    } else {
        // As wide as the ranges are apart from each other.
        DrawnMass {
            mass_per_length: low * (high / low).powf(part),
            density: 0.0,
        }
    }
}

/// Interval of the mass per length in which all four parameters stay in their ranges;
/// empty, the lower end above the upper one, if there is none.
fn bounds(ratios: [f64; 3]) -> (f64, f64) {
    let [stiffness, damping, mass, lead] =
        [STIFFNESS, DAMPING, MASS_PER_LENGTH, LEAD_MASS].map(|i| RANGES[i]);
    let bounds = [
        (mass.min, mass.max),
        (stiffness.min / ratios[0], stiffness.max / ratios[0]),
        (damping.min / ratios[1], damping.max / ratios[1]),
        (lead.min / ratios[2], lead.max / ratios[2]),
    ];
    (
        bounds.iter().map(|b| b.0).fold(0.0, f64::max),
        bounds.iter().map(|b| b.1).fold(f64::INFINITY, f64::min),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ropes::random_rope;

    /// With all ratios known exactly the best mean absolute errors over uniform
    /// ropes are known: k 0.071, c 0.0034, µ 0.0098, lead mass 0.0098.
    #[test]
    fn known_ratios_give_the_best_possible_errors() {
        let mut sum = [0.0; 4];
        let count = 20_000;
        for seed in 0..count {
            let rope = random_rope(seed);
            let mu = rope.mass_per_length_kg_per_m;
            let absolute = [
                rope.joint_stiffness_nm_per_rad,
                rope.joint_damping_nms_per_rad,
                rope.lead_mass_kg,
                mu,
            ];
            let ratios = core::array::from_fn(|i| absolute[i] / mu);
            let found = median_mass_per_length(ratios);
            for (sum, value) in sum.iter_mut().zip(absolute) {
                *sum += (value / mu * found - value).abs();
            }
        }
        for (sum, best) in sum.iter().zip([0.071, 0.0034, 0.0098, 0.0098]) {
            let error = sum / count as f64;
            assert!((error / best - 1.0).abs() < 0.05, "{error} against {best}");
        }
    }

    #[test]
    fn a_weighed_lead_fixes_the_scale() {
        for part in [0.0, 0.5, 1.0] {
            let mass = draw(Some(0.03), [5.0, 0.1, 0.5], part).mass_per_length;
            assert!((mass - 0.06).abs() < 1e-12);
        }
    }

    #[test]
    fn ratios_of_no_rope_still_give_a_positive_mass() {
        let ratios = [1e3, 1e-4, 10.0];
        let [low, high] = [0.0, 1.0].map(|part| draw(None, ratios, part));
        assert_eq!(low.density, 0.0);
        let (low, high) = (low.mass_per_length, high.mass_per_length);
        let median = median_mass_per_length(ratios);
        assert!(low > median && median > high && high > 0.0);
    }
}
