//! Slopes of rollouts with respect to rope parameters and motions.
//!
//! Finite differences with every neighbour in a lane: bases and neighbours of one call
//! are one batch, so that lanes are full. A base and its neighbours always take the
//! same steps; otherwise the time-discretisation error would not cancel and the slopes
//! would be wrong by its size over the step of the difference.

mod direction;
mod plan;
mod slopes;

pub use direction::{Beside, Difference, Direction};
pub use slopes::{ApproachSlope, Doubt, LinkSlope, Neighbours, Sensitivity};

use crate::batch::REPEAT_DIVISOR;
use crate::error::SimulateError;
use crate::rollout::{Candidate, SimOptions, check, check_scene};
use crate::scene::Scene;
use plan::{FamilyPlan, Plan, is_comparable};

/// A candidate and the directions in which it is varied.
#[derive(Debug, Clone, Copy)]
pub struct Family<'a> {
    /// Where slopes are wanted.
    pub base: Candidate<'a>,
    /// Along what.
    pub directions: &'a [Direction<'a>],
}

/// Why there are no slopes.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SensitivityError {
    /// The number of links cannot be varied.
    #[error(
        "base {base}, direction {direction}: the number of links is discrete and has no slope; compare rollouts of both counts instead"
    )]
    LinksAreDiscrete {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its direction, from 0.
        direction: usize,
    },
    /// There is no such parameter.
    #[error("base {base}, direction {direction}: there is no rope parameter {index}, only 1 to 8")]
    UnknownParameter {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its direction, from 0.
        direction: usize,
        /// Index asked for.
        index: usize,
    },
    /// A step or distance is unusable.
    #[error(
        "base {base}, direction {direction}: the step is {value}, but must be finite and above 0"
    )]
    Distance {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its direction, from 0.
        direction: usize,
        /// Value found.
        value: f64,
    },
    /// A neighbour's motion has other acceleration jumps than the base's.
    #[error(
        "base {base}, direction {direction}: the acceleration of the varied motion jumps so differently that it cannot take the same steps; vary it less"
    )]
    SteppedDifferently {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its direction, from 0.
        direction: usize,
    },
    /// A base, named as `candidate`, or an option cannot be simulated.
    #[error(transparent)]
    Base(#[from] SimulateError),
    /// A neighbour cannot be simulated.
    #[error("direction {direction} of a base: {source}")]
    Neighbour {
        /// Index of the direction, from 0.
        direction: usize,
        /// What is wrong; its `candidate` is the index of the base.
        source: SimulateError,
    },
}

/// Slopes around one base; see [`sensitivities`].
///
/// # Errors
/// See [`SensitivityError`].
pub fn sensitivity(
    base: Candidate,
    directions: &[Direction],
    difference: Difference,
    options: &SimOptions,
) -> Result<Sensitivity, SensitivityError> {
    let family = Family { base, directions };
    let mut all = sensitivities(&[family], difference, options)?;
    all.pop().ok_or(SimulateError::WorkerPanicked.into())
}

/// Simulates every base with its neighbours, as one batch; results in the order of
/// `families`. A family in which anything blows up is repeated as a whole in steps of a
/// quarter. Results do not depend on the other families or on the number of threads,
/// except that motions with moved acceleration jumps may shorten everybody's steps a
/// little.
///
/// # Errors
/// The first option, base or neighbour that cannot be simulated.
pub fn sensitivities(
    families: &[Family],
    difference: Difference,
    options: &SimOptions,
) -> Result<Vec<Sensitivity>, SensitivityError> {
    sensitivities_in(&Scene::EMPTY, families, difference, options)
}

/// [`sensitivities`] among obstacles. Slopes exist where touching does not begin, end or
/// slip between base and neighbour; across such an event they are those of a jump, and
/// behind an impact they keep the error of its steps, which neighbours do not share.
///
/// # Errors
/// As [`sensitivities`], and what is wrong with the scene.
pub fn sensitivities_in(
    scene: &Scene,
    families: &[Family],
    difference: Difference,
    options: &SimOptions,
) -> Result<Vec<Sensitivity>, SensitivityError> {
    let bases: Vec<Candidate> = families.iter().map(|f| f.base).collect();
    check(&bases, options)?;
    check_scene(scene, &bases)?;
    let plan = Plan::new(families, difference, options.precision)?;
    plan.check(options)?;
    let everyone: Vec<usize> = (0..plan.members.len()).collect();
    let mut rollouts = plan.run(scene, &everyone, options)?;
    let again: Vec<usize> = plan
        .families
        .iter()
        .filter(|family| !rollouts[family.members()].iter().all(is_comparable))
        .flat_map(FamilyPlan::members)
        .collect();
    if !again.is_empty() {
        let quarter = SimOptions {
            step_s: options.step_s / REPEAT_DIVISOR,
            ..*options
        };
        for (index, rollout) in again.iter().zip(plan.run(scene, &again, &quarter)?) {
            rollouts[*index] = rollout;
        }
    }
    let mut rollouts = rollouts.into_iter();
    let collected = plan.families.iter().filter_map(|family| {
        let base = rollouts.next()?;
        let mut collected = family.collect(&plan.members, base, rollouts.by_ref());
        if again.contains(&family.first) {
            collected.mark_repeated();
        }
        Some(collected)
    });
    Ok(collected.collect())
}
