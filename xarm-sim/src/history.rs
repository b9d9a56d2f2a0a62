//! True motion of the simulated joints over the last seconds.

use arm_model::JointState;
use shared_types::MonotonicNs;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Seconds of motion kept, at 1 kHz.
const KEPT_SAMPLES: usize = 5000;

/// True joint motion at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSample {
    /// When.
    pub at: MonotonicNs,
    /// Position, velocity, acceleration of the joints.
    pub state: JointState,
}

/// The last 5 s of true joint motion, one sample per millisecond, shared with
/// whoever holds a clone.
#[derive(Debug, Clone, Default)]
pub struct MotionHistory {
    samples: Arc<Mutex<VecDeque<JointSample>>>,
}

impl MotionHistory {
    fn samples(&self) -> MutexGuard<'_, VecDeque<JointSample>> {
        // A panic elsewhere leaves whole samples behind.
        self.samples.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn extend(&self, new: impl IntoIterator<Item = JointSample>) {
        let mut samples = self.samples();
        samples.extend(new);
        let surplus = samples.len().saturating_sub(KEPT_SAMPLES);
        samples.drain(..surplus);
    }

    /// The newest sample, `None` before the first.
    #[must_use]
    pub fn latest(&self) -> Option<JointSample> {
        self.samples().back().copied()
    }

    /// Samples later than `after`, oldest first. Calling it again with the
    /// stamp of the last one gives every sample once, as long as calls are
    /// less than 5 s apart.
    #[must_use]
    pub fn since(&self, after: MonotonicNs) -> Vec<JointSample> {
        let samples = self.samples();
        let first = samples.partition_point(|s| s.at <= after);
        samples.range(first..).copied().collect()
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
    fn keeps_five_seconds() {
        let history = MotionHistory::default();
        assert!(history.latest().is_none());
        history.extend((0..6000).map(sample));
        assert_eq!(history.latest(), Some(sample(5999)));
        assert_eq!(history.since(MonotonicNs(5_990_000_000)).len(), 9);
        assert_eq!(history.since(MonotonicNs(0)).first(), Some(&sample(1000)));
    }
}
