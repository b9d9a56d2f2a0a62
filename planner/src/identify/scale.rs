//! The factor that no camera sees.
//!
//! Multiplying stiffness, damping and both masses by one factor changes no
//! motion. Given their ratios and independent uniform priors over the parameter
//! ranges, the mass per length µ has the density `µ³` on the interval in which
//! all four stay in their ranges (`k = α µ`, `c = β µ`, `m_L = γ µ`: the change of
//! variables contributes µ³). Its median minimises the mean absolute error.

use shared_types::rope::RANGES;

/// Rule that turns ratios into masses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassScale {
    lead_mass_kg: Option<f64>,
}

/// What is known about the mass per length once all ratios are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MassPerLength {
    /// Median (kg/m).
    pub middle: f64,
    /// Standard deviation (kg/m); 0 for a weighed lead.
    pub std_dev: f64,
}

impl MassScale {
    /// Scale from the ranges, or from the lead's mass if it was weighed.
    #[must_use]
    pub fn new(lead_mass_kg: Option<f64>) -> Self {
        Self { lead_mass_kg }
    }

    /// Mass per length for the ratios `[k/µ, c/µ, m_L/µ]`.
    #[must_use]
    pub fn mass_per_length(&self, ratios: [f64; 3]) -> MassPerLength {
        if let Some(lead_mass_kg) = self.lead_mass_kg {
            return MassPerLength {
                middle: lead_mass_kg / ratios[2],
                std_dev: 0.0,
            };
        }
        let (low, high) = bounds(ratios);
        if low < high {
            cubic_density(low, high)
        } else {
            // No rope of the ranges has these ratios: the mass per length that
            // breaks the ranges least, by equal factors at both ends.
            let middle = (low * high).sqrt();
            MassPerLength {
                middle,
                std_dev: low - middle,
            }
        }
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

impl MassScale {
    /// The mass per length at the quantile `part` (0 to 1) of its density for the
    /// ratios `[k/µ, c/µ, m_L/µ]`.
    pub(super) fn draw(&self, ratios: [f64; 3], part: f64) -> DrawnMass {
        let product: f64 = ratios.iter().product();
        if let Some(lead_mass_kg) = self.lead_mass_kg {
            let mass_per_length = lead_mass_kg / ratios[2];
            let inside = |i: usize, value: f64| value >= RANGES[i].min && value <= RANGES[i].max;
            let possible = inside(5, mass_per_length)
                && inside(3, ratios[0] * mass_per_length)
                && inside(2, ratios[1] * mass_per_length);
            return DrawnMass {
                mass_per_length,
                density: if possible {
                    ratios[0] * ratios[1] * mass_per_length.powi(3)
                } else {
                    0.0
                },
            };
        }
        let (low, high) = bounds(ratios);
        if low < high {
            let (a, b) = (low.powi(4), high.powi(4));
            DrawnMass {
                mass_per_length: (a + part * (b - a)).powf(0.25),
                density: product * (b - a),
            }
        } else {
            // As wide as the ranges are apart from each other.
            DrawnMass {
                mass_per_length: low * (high / low).powf(part),
                density: 0.0,
            }
        }
    }
}

/// Interval of the mass per length in which all four parameters stay in their ranges;
/// empty, the lower end above the upper one, if there is none.
fn bounds(ratios: [f64; 3]) -> (f64, f64) {
    let [stiffness, damping, mass, lead] = [RANGES[3], RANGES[2], RANGES[5], RANGES[6]];
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

/// Median and deviation of the density proportional to `x³` on an interval.
fn cubic_density(a: f64, b: f64) -> MassPerLength {
    let moment = |n: i32| (b.powi(n) - a.powi(n)) / f64::from(n);
    let total = moment(4);
    let mean = moment(5) / total;
    MassPerLength {
        middle: ((a.powi(4) + b.powi(4)) / 2.0).powf(0.25),
        std_dev: (moment(6) / total - mean * mean).max(0.0).sqrt(),
    }
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
            let found = MassScale::new(None).mass_per_length(ratios).middle;
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
        let found = MassScale::new(Some(0.03)).mass_per_length([5.0, 0.1, 0.5]);
        assert!((found.middle - 0.06).abs() < 1e-12 && found.std_dev == 0.0);
    }

    #[test]
    fn ratios_of_no_rope_still_give_a_positive_mass() {
        let found = MassScale::new(None).mass_per_length([1e3, 1e-4, 10.0]);
        assert!(found.middle > 0.0 && found.middle.is_finite() && found.std_dev > 0.0);
    }
}
