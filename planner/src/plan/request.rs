//! What is asked for when a throw is planned.

use super::{PlanOptions, PosteriorEnsemble, ThrowGoal};
use crate::arm_response::Following;
use arm_model::{Cell, Limits};
use serde::{Deserialize, Serialize};
use shared_types::RopeParams;

/// A throw to plan, in this process or by the planner's service.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlanRequest {
    /// What the throw is for.
    pub goal: ThrowGoal,
    /// The rope, as identified or known.
    pub rope: RopeParams,
    /// What the arm may do.
    pub limits: Limits,
    /// The pole, and what stands around the arm.
    pub cell: Cell,
    /// Size of the search.
    pub options: PlanOptions,
    /// What the rope might be instead.
    pub ensemble: PosteriorEnsemble,
    /// How the arm follows its setpoints; none for an arm that does exactly that.
    pub following: Option<Following>,
}

impl PlanRequest {
    /// A throw for a rope that is known, by an arm that follows exactly, within the default
    /// limits and in the default cell.
    #[must_use]
    pub fn new(goal: ThrowGoal, rope: &RopeParams, options: PlanOptions) -> Self {
        Self {
            goal,
            rope: *rope,
            limits: Limits::default(),
            cell: Cell::default(),
            options,
            ensemble: PosteriorEnsemble::default(),
            following: None,
        }
    }
}
