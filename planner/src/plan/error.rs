//! How far a search for a throw has come, and why there is no plan.

use crate::OutOfRange;
use crate::arm_response::FollowError;
use arm_model::TrajectoryError;
use cmaes::CmaError;
use rope_sim::SimulateError;
use rope_sim::sensitivity::SensitivityError;
use shared_types::ipc::message::Progress;
use shared_types::rope::RopeError;
use std::ops::RangeInclusive;

/// How far a search has come, reported after every generation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanProgress {
    /// Generations done.
    pub generation: usize,
    /// Most generations.
    pub generations: usize,
    /// Best fitness so far.
    pub fitness: f64,
    /// Task error of that candidate (m).
    pub error_m: f64,
    /// Candidates simulated so far.
    pub simulations: usize,
}

impl From<PlanProgress> for Progress {
    fn from(p: PlanProgress) -> Self {
        Self {
            done: u32::try_from(p.generation).unwrap_or(u32::MAX),
            total: u32::try_from(p.generations).unwrap_or(u32::MAX),
            value: 100.0 * p.error_m,
            label: "best cm".to_owned(),
        }
    }
}

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A coordinate of the target is not a finite number.
    #[error("target {target_m:?} has a coordinate that is not a finite number of metres")]
    TargetNotFinite {
        /// The target as given (m).
        target_m: [f64; 3],
    },
    /// No throw of this rope can bring its tip to the target.
    #[error(
        "target ({:.2}, {:.2}, {:.2}) m is out of reach: {reason}; the nearest point in reach is ({:.2}, {:.2}, {:.2}) m",
        target_m[0], target_m[1], target_m[2], nearest_m[0], nearest_m[1], nearest_m[2]
    )]
    Unreachable {
        /// The target as given (m).
        target_m: [f64; 3],
        /// A point near it that can be reached (m).
        nearest_m: [f64; 3],
        /// Which bound it breaks.
        reason: String,
    },
    /// The target lies in the arm.
    #[error(
        "target ({:.3}, {:.3}, {:.3}) m lies in the arm's {part}; name one at least {:.0} cm away from it",
        target_m[0], target_m[1], target_m[2], 100.0 * room_m
    )]
    InArm {
        /// The target as given (m).
        target_m: [f64; 3],
        /// Part of the arm.
        part: &'static str,
        /// Room that a target needs around the arm (m).
        room_m: f64,
    },
    /// The rope's parameters are not physical.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// An option of the search is out of range.
    #[error("option {0}")]
    Option(#[from] OutOfRange),
    /// The search strategy cannot go on.
    #[error(transparent)]
    Search(#[from] CmaError),
    /// Waypoints or their times make no trajectory.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// The rope simulator refused or failed.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// Neighbouring throws could not be simulated.
    #[error(transparent)]
    Slopes(#[from] SensitivityError),
    /// How the arm moves is not known.
    #[error(transparent)]
    Follow(#[from] FollowError),
    /// The best throw found still lets arm or pole collide.
    #[error(
        "every throw found within {simulations} simulations lets the arm or its pole collide: move the target away from the arm or search longer"
    )]
    OnlyCollisions {
        /// Candidates simulated.
        simulations: u32,
    },
    /// The finished trajectory breaks a limit after all; nothing is sent.
    #[error("the planned trajectory breaks a limit: {what}")]
    BreaksLimit {
        /// The limit, with value and time.
        what: String,
    },
    /// The caller broke off.
    #[error("planning was cancelled after generation {generation}")]
    Cancelled {
        /// Generations done.
        generation: usize,
    },
}

impl PlanError {
    /// Refuses a number that is not one of the range.
    pub(super) fn unless_within(
        key: &'static str,
        value: f64,
        range: RangeInclusive<f64>,
        expected: &'static str,
    ) -> Result<(), Self> {
        OutOfRange::check([(key, value, range.contains(&value), expected)])?;
        Ok(())
    }

    /// Refuses numbers that are not finite.
    pub(super) fn unless_finite(
        numbers: impl IntoIterator<Item = (&'static str, f64)>,
    ) -> Result<(), Self> {
        numbers.into_iter().try_for_each(|(key, value)| {
            Self::unless_within(key, value, f64::MIN..=f64::MAX, "finite")
        })
    }

    /// Whether another request would help.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::TargetNotFinite { .. }
                | Self::Unreachable { .. }
                | Self::InArm { .. }
                | Self::Rope(_)
                | Self::Follow(_)
                | Self::Option(_)
        )
    }
}
