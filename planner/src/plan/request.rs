//! What is asked for when a throw is planned.

use super::{Drape, Lob, PlanOptions, PosteriorEnsemble, Strike, ThrowTask};
use crate::OutOfRange;
use crate::arm_response::Following;
use crate::history::ArmHistory;
use arm_model::{Cell, Limits};
use serde::{Deserialize, Serialize};
use shared_types::{RopeParams, Task};

/// A task at a target, with its tuned values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ThrowGoal {
    /// Strike a point.
    Strike(Strike),
    /// Lob onto a board.
    Lob(Lob),
    /// Drape over a wall.
    Drape(Drape),
}

impl ThrowGoal {
    /// The task behind its trait.
    #[must_use]
    pub fn task(&self) -> &dyn ThrowTask {
        match self {
            Self::Strike(task) => task,
            Self::Lob(task) => task,
            Self::Drape(task) => task,
        }
    }

    /// Refuses numbers of the task's own that are not finite.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        match self {
            Self::Strike(_) => Ok(()),
            Self::Lob(task) => task.config.check(),
            Self::Drape(task) => task.config.check(),
        }
    }

    /// Which task it is.
    #[must_use]
    pub fn kind(&self) -> Task {
        match self {
            Self::Strike(_) => Task::Strike,
            Self::Lob(_) => Task::Lob,
            Self::Drape(_) => Task::Drape,
        }
    }
}

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
    /// What the arm did before, where the rope still swings when the throw begins; none where
    /// it hangs still.
    pub before: Option<ArmHistory>,
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
            before: None,
        }
    }
}
