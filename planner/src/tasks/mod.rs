//! The tasks a throw can have, one file each behind one trait, and what they share: the
//! search, progress, errors, start pose and reach.

mod belief;
mod config;
mod drape;
mod finalists;
mod lob;
mod planning;
mod reach;
mod reach_map;
mod robust;
mod scene;
mod setup;
mod strike;
mod task;
#[cfg(test)]
mod tests;
mod throw;

pub use belief::{Belief, ropes_of};
pub use config::{PlanOptions, Robustness, ThrowConfig, ThrowWeights};
pub use drape::{Drape, DrapeConfig};
pub use lob::{Lob, LobConfig};
pub use planning::{PlanRequest, Planned, plan_throw};
pub use reach::{check_reach, start_pose_for};
pub use reach_map::{GridCell, ReachMap};
pub use scene::PlanarScene;
pub use strike::Strike;
pub use task::{ThrowTask, proximity_reward, simulator_for, verdict};
pub use throw::{ThrowOutcome, ThrowSimulator};

use crate::cmaes::CmaError;
use crate::response::FollowError;
use arm_model::TrajectoryError;
use rope_sim::SimulateError;
use rope_sim::sensitivity::SensitivityError;
use shared_types::rope::RopeError;

/// How far a search has come, told after every generation.
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
    /// The rope's parameters are not physical.
    #[error(transparent)]
    Rope(#[from] RopeError),
    /// An option of the search is out of range.
    #[error("option `{option}` is {value}, but must be {expected}")]
    Option {
        /// Name of the option.
        option: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        expected: &'static str,
    },
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
