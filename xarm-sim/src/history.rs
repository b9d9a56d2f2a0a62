//! What a running arm keeps of the past: true motion of its joints, and a log of what it
//! got, from whom, and what happened to it.

use super::event::TimedEvent;
use arm_model::JointState;
use shared_types::MonotonicNs;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// True joint motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSample {
    /// When.
    pub at: MonotonicNs,
    /// Position, velocity, acceleration of the joints.
    pub state: JointState,
}

/// A panic elsewhere leaves whole values behind.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Something that a [`History`] keeps.
pub trait Timed: Copy {
    /// How many are kept.
    const KEPT: usize;

    /// When it was.
    fn at(&self) -> MonotonicNs;
}

impl Timed for JointSample {
    /// 5 s at 1 kHz.
    const KEPT: usize = 5000;

    fn at(&self) -> MonotonicNs {
        self.at
    }
}

impl Timed for TimedEvent {
    /// Some minutes of setpoints.
    const KEPT: usize = 100_000;

    fn at(&self) -> MonotonicNs {
        self.at
    }
}

/// The newest of their kind, oldest first, shared with whoever holds a clone. The oldest
/// give way to new ones.
#[derive(Debug, Clone)]
pub struct History<T> {
    kept: Arc<Mutex<VecDeque<T>>>,
}

impl<T> Default for History<T> {
    fn default() -> Self {
        Self {
            kept: Arc::default(),
        }
    }
}

impl<T: Timed> History<T> {
    pub(super) fn extend(&self, new: impl IntoIterator<Item = T>) {
        let mut kept = lock(&self.kept);
        kept.extend(new);
        let surplus = kept.len().saturating_sub(T::KEPT);
        kept.drain(..surplus);
    }

    /// The newest, `None` before the first.
    #[must_use]
    pub fn latest(&self) -> Option<T> {
        lock(&self.kept).back().copied()
    }

    /// What was later than `after`. Calling it again with the time of the last one gives
    /// every one once, as long as it is still kept.
    #[must_use]
    pub fn since(&self, after: MonotonicNs) -> Vec<T> {
        let kept = lock(&self.kept);
        kept.iter().filter(|it| it.at() > after).copied().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use arm_model::JointVector;

    fn sample(ms: u64) -> JointSample {
        JointSample {
            at: MonotonicNs(ms * 1_000_000),
            state: JointState::at_rest(JointVector::splat(ms as f64)),
        }
    }

    #[test]
    fn keeps_five_seconds_of_motion() {
        let history = History::default();
        assert!(history.latest().is_none());
        history.extend((0..6000).map(sample));
        assert_eq!(history.latest(), Some(sample(5999)));
        assert_eq!(history.since(MonotonicNs(5_990_000_000)).len(), 9);
        assert_eq!(history.since(MonotonicNs(0)).first(), Some(&sample(1000)));
    }
}
