//! In which direction a rope or its motion is varied, and how far.

use super::SensitivityError;
use crate::motion::AttachMotion;
use crate::rollout::{Candidate, Precision};
use shared_types::RopeParams;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};

/// Relative step of every parameter in double precision: with central differences the
/// cut-off error is 1e-10 and rounding about 1e-7 of the slope.
const RELATIVE_STEP_F64: f64 = 1e-5;
/// Relative steps in single precision, in the order of [`RANGES`]: they move the tip by
/// millimetres, a hundred times its rounding. Radii and inertia scale hardly act at all.
const RELATIVE_STEPS_F32: [f64; ROPE_PARAMETERS] =
    [0.0, 5e-3, 5e-2, 2e-2, 0.2, 2e-2, 2e-2, 0.1, 0.2];

/// How slopes are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Difference {
    /// From the base to one neighbour: one rollout per direction, error proportional to
    /// the step.
    Forward,
    /// Between neighbours on both sides: two rollouts per direction, error proportional
    /// to the square of the step.
    Central,
}

/// A neighbour of the base.
#[derive(Debug, Clone, Copy)]
pub struct Beside<T> {
    /// What takes the base's place.
    pub at: T,
    /// How far away it is, in the unit in which slopes are wanted; positive.
    pub distance: f64,
}

/// One direction in which a candidate is varied.
#[derive(Clone, Copy)]
pub enum Direction<'a> {
    /// One rope parameter; slopes are per its SI unit.
    Parameter {
        /// Index in the order of [`RopeParams::to_array`], 1 to 8: the number of links
        /// (0) is discrete and has no slope.
        index: usize,
        /// Step in the parameter's unit; `None` takes a sensible one for the precision.
        step: Option<f64>,
    },
    /// Other ropes of the same link count, for coordinates that change several
    /// parameters at once.
    Rope {
        /// Neighbour towards larger values.
        plus: Beside<RopeParams>,
        /// Neighbour towards smaller values; not used by [`Difference::Forward`].
        minus: Option<Beside<RopeParams>>,
    },
    /// Other attach motions, such as those of a moved waypoint.
    Motion {
        /// Neighbour towards larger values.
        plus: Beside<&'a dyn AttachMotion>,
        /// Neighbour towards smaller values; not used by [`Difference::Forward`].
        minus: Option<Beside<&'a dyn AttachMotion>>,
    },
}

impl core::fmt::Debug for Direction<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Parameter { index, step } => f
                .debug_struct("Parameter")
                .field("index", index)
                .field("step", step)
                .finish(),
            Self::Rope { plus, minus } => f
                .debug_struct("Rope")
                .field("plus", plus)
                .field("minus", minus)
                .finish(),
            Self::Motion { plus, minus } => f
                .debug_struct("Motion")
                .field("plus_distance", &plus.distance)
                .field("minus_distance", &minus.map(|m| m.distance))
                .finish_non_exhaustive(),
        }
    }
}

/// A rope on a motion that is to be simulated for a direction.
#[derive(Clone, Copy)]
pub(super) struct Variant<'a> {
    pub(super) rope: RopeParams,
    pub(super) motion: &'a dyn AttachMotion,
    /// Signed distance from the base along the direction.
    pub(super) offset: f64,
}

/// One or two variants; the first is where slopes are taken to.
pub(super) type Variants<'a> = (Variant<'a>, Option<Variant<'a>>);

impl<'a> Direction<'a> {
    /// The neighbours of `base`.
    pub(super) fn variants(
        &self,
        base: &Candidate<'a>,
        difference: Difference,
        precision: Precision,
    ) -> Result<Variants<'a>, DirectionError> {
        let central = difference == Difference::Central;
        match *self {
            Self::Parameter { index, step } => {
                beside_parameter(base, index, step, central, precision)
            }
            Self::Rope { plus, minus } => {
                let variant = |beside: Beside<RopeParams>, sign: f64| {
                    if beside.at.links != base.rope.links {
                        return Err(DirectionError::LinksAreDiscrete);
                    }
                    Ok(Variant {
                        rope: beside.at,
                        motion: base.motion,
                        offset: sign * positive(beside.distance)?,
                    })
                };
                let minus = minus.filter(|_| central).map(|m| variant(m, -1.0));
                Ok((variant(plus, 1.0)?, minus.transpose()?))
            }
            Self::Motion { plus, minus } => {
                let variant = |beside: Beside<&'a dyn AttachMotion>, sign: f64| {
                    Ok(Variant {
                        rope: *base.rope,
                        motion: beside.at,
                        offset: sign * positive(beside.distance)?,
                    })
                };
                let minus = minus.filter(|_| central).map(|m| variant(m, -1.0));
                Ok((variant(plus, 1.0)?, minus.transpose()?))
            }
        }
    }
}

/// What is wrong with a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum DirectionError {
    LinksAreDiscrete,
    UnknownParameter { index: usize },
    Distance { value: f64 },
}

impl DirectionError {
    pub(super) fn at(self, base: usize, direction: usize) -> SensitivityError {
        match self {
            Self::LinksAreDiscrete => SensitivityError::LinksAreDiscrete { base, direction },
            Self::UnknownParameter { index } => SensitivityError::UnknownParameter {
                base,
                direction,
                index,
            },
            Self::Distance { value } => SensitivityError::Distance {
                base,
                direction,
                value,
            },
        }
    }
}

fn positive(value: f64) -> Result<f64, DirectionError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(DirectionError::Distance { value })
    }
}

/// Neighbours along one parameter. At the end of what is physical only the neighbour
/// inside is left.
fn beside_parameter<'a>(
    base: &Candidate<'a>,
    index: usize,
    step: Option<f64>,
    central: bool,
    precision: Precision,
) -> Result<Variants<'a>, DirectionError> {
    if index == 0 {
        return Err(DirectionError::LinksAreDiscrete);
    }
    if index >= ROPE_PARAMETERS {
        return Err(DirectionError::UnknownParameter { index });
    }
    let values = base.rope.to_array();
    let relative = match precision {
        Precision::F64 => RELATIVE_STEP_F64,
        Precision::F32 => RELATIVE_STEPS_F32[index],
    };
    let step =
        positive(step.unwrap_or_else(|| relative * values[index].abs().max(RANGES[index].min)))?;
    let variant = |offset: f64| {
        let mut moved = values;
        moved[index] += offset;
        Variant {
            rope: RopeParams::from_array(moved),
            motion: base.motion,
            // As it came out in floating point.
            offset: moved[index] - values[index],
        }
    };
    let (plus, minus) = (variant(step), variant(-step));
    let is_physical = |v: &Variant| v.rope.validate().is_ok();
    Ok(if !is_physical(&plus) && is_physical(&minus) {
        (minus, None)
    } else {
        let both = central && is_physical(&minus);
        (plus, both.then_some(minus))
    })
}
