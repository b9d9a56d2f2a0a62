//! Why there is no plan.

use crate::OutOfRange;
use crate::arm_response::FollowError;
use crate::history::HistoryError;
use arm_model::TrajectoryError;
use cmaes::CmaError;
use rope_sim::SimulateError;
use rope_sim::sensitivity::SensitivityError;
use shared_types::rope::RopeError;

/// Why there is no plan.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The target is no number, or lies in the arm.
    #[error("{0}")]
    Target(String),
    /// No throw of this rope can bring its tip to the target.
    #[error(
        "target ({:.2}, {:.2}, {:.2}) m is out of reach: {reason}; these bounds allow ({:.2}, {:.2}, {:.2}) m",
        target_m[0], target_m[1], target_m[2], nearest_m[0], nearest_m[1], nearest_m[2]
    )]
    Unreachable {
        /// The target as given (m).
        target_m: [f64; 3],
        /// A point within these bounds (m), near it or what it would be in cm or mm.
        nearest_m: [f64; 3],
        /// Which bound it breaks.
        reason: String,
    },
    /// The rope's parameters are not physical.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// The arm does not carry the rope.
    #[error(
        "rope and tip weigh {mass_kg:.2} kg, but the arm carries {payload_kg} kg at most: check `lead_mass_kg` and `mass_per_length_kg_per_m`"
    )]
    Payload {
        /// Mass of rope and tip (kg).
        mass_kg: f64,
        /// What the arm carries (kg).
        payload_kg: f64,
    },
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
    /// Where the rope is when the throw begins is not known.
    #[error(transparent)]
    History(#[from] HistoryError),
    /// The best throw found within so many simulations still lets arm or pole collide.
    #[error(
        "every throw found within {0} simulations lets the arm or its pole collide: move the target away from the arm or search longer"
    )]
    OnlyCollisions(u32),
    /// The last throw cannot be corrected.
    #[error("{0}")]
    Again(String),
    /// The finished trajectory breaks a limit after all; nothing is sent.
    #[error("the planned trajectory breaks a limit: {0}")]
    BreaksLimit(String),
}

impl PlanError {
    /// Whether another request would help.
    #[must_use]
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Target(_)
                | Self::Again(_)
                | Self::Unreachable { .. }
                | Self::Rope(_)
                | Self::Payload { .. }
                | Self::Follow(_)
                | Self::Option(_)
        )
    }
}
