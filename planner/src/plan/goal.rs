//! Any of the tasks, as it stands in a request.

use super::{Drape, Lob, PlanError, Strike, ThrowTask};
use serde::{Deserialize, Serialize};
use shared_types::Task;

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
    pub(super) fn check(&self) -> Result<(), PlanError> {
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
