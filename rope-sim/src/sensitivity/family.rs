//! A rope on a motion with its neighbours, and why there are no slopes around it.

use crate::error::SimulateError;
use crate::motion::AttachMotion;
use crate::rollout::Candidate;
use shared_types::RopeParams;

/// What takes the place of the base's rope or motion, and how far away it is, in the unit
/// in which slopes are wanted.
#[derive(Debug, Clone, Copy)]
pub enum Perturbation<'a> {
    /// Another rope of the same link count.
    Rope {
        /// The rope.
        rope: RopeParams,
        /// Its distance from the base's; positive.
        distance: f64,
    },
    /// Another attach motion, such as that of a moved waypoint.
    Motion {
        /// The motion.
        motion: &'a dyn AttachMotion,
        /// Its distance from the base's; positive.
        distance: f64,
    },
}

/// A candidate and its neighbours.
#[derive(Debug, Clone, Copy)]
pub struct Family<'a> {
    /// Where slopes are wanted.
    pub base: Candidate<'a>,
    /// Towards what.
    pub perturbations: &'a [Perturbation<'a>],
}

/// Why there are no slopes.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SensitivityError {
    /// The number of links cannot be varied.
    #[error(
        "base {base}, neighbour {neighbour}: the number of links is discrete and has no slope; compare rollouts of both counts instead"
    )]
    LinksAreDiscrete {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its neighbour, from 0.
        neighbour: usize,
    },
    /// A distance is unusable.
    #[error(
        "base {base}, neighbour {neighbour}: the step is {value}, but must be finite and above 0"
    )]
    Distance {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its neighbour, from 0.
        neighbour: usize,
        /// Value found.
        value: f64,
    },
    /// A neighbour's motion has other acceleration jumps than the base's.
    #[error(
        "base {base}, neighbour {neighbour}: the acceleration of the varied motion jumps so differently that it cannot take the same steps; vary it less"
    )]
    SteppedDifferently {
        /// Index of the base, from 0.
        base: usize,
        /// Index of its neighbour, from 0.
        neighbour: usize,
    },
    /// A base, named as `candidate`, or an option cannot be simulated.
    #[error(transparent)]
    Base(#[from] SimulateError),
    /// A neighbour cannot be simulated.
    #[error("neighbour {neighbour} of a base: {source}")]
    Neighbour {
        /// Index of the neighbour, from 0.
        neighbour: usize,
        /// What is wrong; its `candidate` is the index of the base.
        source: SimulateError,
    },
}
