//! What is fitted to a recording: a rope, and how it leaves its holder.

use nalgebra::SVector;
use serde::Serialize;
use shared_types::{AirDrag, BendingFriction, RopeExtras, RopeParams};

/// Fitted numbers.
pub(super) const COUNT: usize = 12;
/// Their values, in the order of [`PARAMETERS`].
pub(super) type Values = SVector<f64, COUNT>;

/// One fitted number.
pub(super) struct Parameter {
    name: &'static str,
    pub start: f64,
    /// Step of its slope.
    pub step: f64,
    low: f64,
    high: f64,
}

const fn about(name: &'static str, start: f64, step: f64, [low, high]: [f64; 2]) -> Parameter {
    Parameter {
        name,
        start,
        step,
        low,
        high,
    }
}

/// A mass per length (kg/m). The motion tells the ratios to it only: of stiffness, damping,
/// drag and friction.
const MASS_PER_LENGTH_KG_PER_M: f64 = 0.1;
/// Links of the simulated rope.
const LINKS: u32 = 24;
const RADIUS_M: f64 = 0.03;
/// Logarithm of a friction, or of a drag's coefficient, that does nothing.
const OFF: f64 = -12.0;

/// Numbers that each begin the fit: length, stiffness and damping, and the way from the holder.
const LENGTH: usize = 0;
const STIFFNESS: usize = 1;
const DAMPING: usize = 2;
const TILT: [usize; 2] = [3, 4];
const DRAG: usize = 5;
const CURVATURE: [usize; 2] = [6, 7];
const MASS_SLOPE: usize = 8;
const CLAMP: usize = 9;
const FRICTION: usize = 10;
const SLIP: usize = 11;

/// Bounds keep the search where the simulator can follow; none is a prior.
pub(super) const PARAMETERS: [Parameter; COUNT] = [
    about("length", 1.85, 2e-3, [1.0, 3.0]),
    // Logarithms of N m/rad and N m s/rad.
    about("stiffness", 1.1, 0.02, [-3.0, 4.0]),
    about("damping", -0.5, 0.02, [-5.0, 2.2]),
    about("tilt about y", 0.3, 5e-3, [-1.0, 1.0]),
    about("tilt about z", 0.0, 5e-3, [-0.5, 0.5]),
    // Logarithm of the drag coefficient across the rope.
    about("drag", 0.0, 0.03, [OFF, 3.0]),
    // rad/m.
    about("curvature about x", 0.0, 5e-3, [-1.0, 1.0]),
    about("curvature about y", 0.0, 5e-3, [-1.0, 1.0]),
    about("mass slope", 0.0, 0.02, [-0.9, 0.9]),
    // Logarithm of the first joint's stiffness by the others'.
    about("clamp stiffness", 0.0, 0.03, [-1.5, 1.5]),
    // Logarithms of N m and rad/m.
    about("friction", -4.0, 0.05, [OFF, 0.0]),
    about("slip", 0.0, 0.05, [-3.0, 2.5]),
];

/// How much of physics a fit has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Physics {
    /// An elastic, damped rope in vacuum, as in the paper.
    Elastic,
    /// Air drag, rest curvature, uneven mass and a clamp that gives as well.
    Elaborate,
    /// Dry friction in bending as well.
    Friction,
}

impl Physics {
    pub const ALL: [Self; 3] = [Self::Elastic, Self::Elaborate, Self::Friction];

    pub const fn name(self) -> &'static str {
        match self {
            Self::Elastic => "elastic",
            Self::Elaborate => "with drag, curvature, mass, clamp",
            Self::Friction => "with friction",
        }
    }

    /// Where a fit begins.
    pub fn start(self) -> Values {
        let mut x = Values::from_fn(|i, _| PARAMETERS[i].start);
        if self == Self::Elastic {
            x[DRAG] = OFF;
        }
        if self != Self::Friction {
            x[FRICTION] = OFF;
        }
        x
    }

    /// The numbers that are fitted in turn: to the rope at rest, to its coarse motion, to all.
    pub fn stages(self) -> [Vec<usize>; 3] {
        let fitted = match self {
            Self::Elastic => DRAG,
            Self::Elaborate => FRICTION,
            Self::Friction => COUNT,
        };
        let coarse = [LENGTH, STIFFNESS, DAMPING, TILT[0], TILT[1], DRAG];
        let still = vec![STIFFNESS, TILT[0], TILT[1]];
        let coarse = coarse.into_iter().filter(|i| *i < fitted).collect();
        [still, coarse, (0..fitted).collect()]
    }
}

/// Brings values to where they are allowed.
pub(super) fn bounded(x: &Values) -> Values {
    Values::from_fn(|i, _| x[i].clamp(PARAMETERS[i].low, PARAMETERS[i].high))
}

/// The rope.
pub(super) fn rope(x: &Values) -> RopeParams {
    let extras = RopeExtras {
        rest_curvature_per_m: [x[CURVATURE[0]], x[CURVATURE[1]], 0.0],
        mass_slope: x[MASS_SLOPE],
        clamp_stiffness: x[CLAMP].exp(),
        air_drag: (x[DRAG] > OFF).then(|| AirDrag {
            air_density_kg_m3: 1.2,
            normal_coefficient: x[DRAG].exp(),
            tangential_coefficient: 0.02,
            lead_coefficient: 0.5,
        }),
        friction: (x[FRICTION] > OFF).then(|| BendingFriction {
            moment_max_nm: x[FRICTION].exp(),
            slip_curvature_per_m: x[SLIP].exp(),
        }),
    };
    let plain = RopeParams {
        links: LINKS,
        length_m: x[LENGTH],
        joint_damping_nms_per_rad: x[DAMPING].exp(),
        joint_stiffness_nm_per_rad: x[STIFFNESS].exp(),
        radius_m: RADIUS_M,
        mass_per_length_kg_per_m: MASS_PER_LENGTH_KG_PER_M,
        // There is none but a marker.
        lead_mass_kg: 1e-3,
        lead_radius_m: 0.01,
        link_extra_scale: 0.5,
        extras: None,
    };
    plain.with_extras(extras)
}

/// Names of the fitted numbers that are at a bound of the search.
pub(super) fn at_bounds(x: &Values, physics: Physics) -> Vec<&'static str> {
    let [_, _, fitted] = physics.stages();
    let at = |i: usize| {
        let p = &PARAMETERS[i];
        (x[i] <= p.low || x[i] >= p.high).then_some(p.name)
    };
    fitted.into_iter().filter_map(at).collect()
}

/// Turns of the rope against its holder, about the base's y axis and then its own z axis (rad).
pub(super) fn tilt_rad(x: &Values) -> [f64; 2] {
    TILT.map(|i| x[i])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_physics_is_fitted_with_more_numbers_and_every_start_can_be_simulated() {
        let numbers = Physics::ALL.map(|physics| physics.stages()[2].len());
        assert_eq!(numbers, [5, 10, 12]);
        for physics in Physics::ALL {
            let rope = rope(&physics.start());
            rope.validate().unwrap();
            let beyond = rope.beyond();
            assert_eq!(beyond.friction.is_some(), physics == Physics::Friction);
            assert_eq!(beyond.air_drag.is_none(), physics == Physics::Elastic);
        }
        for end in [f64::NEG_INFINITY, f64::INFINITY] {
            let mut x = bounded(&Values::repeat(end));
            // A slope is taken one step beyond.
            for (value, parameter) in x.iter_mut().zip(&PARAMETERS) {
                *value += parameter.step;
            }
            rope(&x).validate().unwrap();
        }
    }
}
