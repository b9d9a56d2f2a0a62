//! What a replay finds: differences, gaps, and why there may be nothing to step.

use super::compare::Unequal;
use super::log::LogError;
use crate::control::record::RestoreError;
use serde::Serialize;

/// Why a recording cannot be replayed at all.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ReplayError {
    /// No recording.
    #[error(transparent)]
    Log(#[from] LogError),
    /// A cycle of another layout.
    #[error("{0}; use the version of `wag` that made the recording")]
    Restore(RestoreError),
    /// No state to begin from.
    #[error(
        "the recording holds no state that this version's core can begin from (made by version {core}); \
         use the version of `wag` that made it"
    )]
    NoState {
        /// Version that made it, if known.
        core: String,
    },
    /// A cycle to begin at that is not there.
    #[error("no cycle from {from} on can be stepped: the recording holds cycles {first} to {last}")]
    OutOfRange {
        /// Asked for.
        from: u64,
        /// First cycle there is.
        first: u64,
        /// Last cycle there is.
        last: u64,
    },
}

/// Where recording and replay differ first.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Cycle.
    pub cycle: u64,
    /// Field and both values.
    #[serde(flatten)]
    pub unequal: Unequal,
}

/// Cycles that could not be compared, and why.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Gap {
    /// Last cycle before it, if any was stepped.
    pub after_cycle: Option<u64>,
    /// Cycle at which the core was stepped again, if it was.
    pub until_cycle: Option<u64>,
    /// Why, in words.
    pub reason: String,
    /// Whether the recording itself is damaged, and not merely incomplete.
    pub damaged: bool,
}

/// What a replay found.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Replay {
    /// Version of the program that made the recording.
    pub core: String,
    /// First cycle compared.
    pub first_cycle: u64,
    /// Last cycle compared.
    pub last_cycle: u64,
    /// Cycles stepped and compared.
    pub cycles: u64,
    /// Causes of stops compared.
    pub causes: u64,
    /// Whole states compared, at keyframes.
    pub states: u64,
    /// Bytes that differ, in all of them.
    pub differing_bytes: u64,
    /// The first difference.
    pub first_difference: Option<Difference>,
    /// Cycles that were read but could not be stepped for want of a state.
    pub skipped: u64,
    /// What is missing.
    pub gaps: Vec<Gap>,
}

impl Replay {
    /// Whether every cycle compared is the same and nothing is damaged.
    #[must_use]
    pub fn is_exact(&self) -> bool {
        self.differing_bytes == 0 && !self.gaps.iter().any(|g| g.damaged)
    }

    pub(super) fn differs(&mut self, cycle: u64, unequal: Unequal) {
        self.differing_bytes += u64::from(unequal.bytes);
        if self
            .first_difference
            .as_ref()
            .is_none_or(|first| cycle < first.cycle)
        {
            self.first_difference = Some(Difference { cycle, unequal });
        }
    }
}
