//! True motion of the simulated joints over the last seconds.

use arm_model::{JointState, JointVector};
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

    /// Motion at `at`, linear between samples; `None` outside what is kept.
    #[must_use]
    pub fn at(&self, at: MonotonicNs) -> Option<JointState> {
        let samples = self.samples();
        let next = samples.partition_point(|s| s.at < at);
        let after = samples.get(next)?;
        if after.at == at {
            return Some(after.state);
        }
        let before = samples.get(next.checked_sub(1)?)?;
        let u = at.since_s(before.at) / after.at.since_s(before.at);
        let mix = |a: JointVector, b: JointVector| a.zip_with(b, |a, b| a + u * (b - a));
        Some(JointState {
            q: mix(before.state.q, after.state.q),
            qd: mix(before.state.qd, after.state.qd),
            qdd: mix(before.state.qdd, after.state.qdd),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(ms: u64) -> JointSample {
        JointSample {
            at: MonotonicNs(ms * 1_000_000),
            state: JointState::at_rest(JointVector::splat(ms as f64)),
        }
    }

    #[test]
    fn keeps_five_seconds_and_interpolates() {
        let history = MotionHistory::default();
        assert!(history.latest().is_none());
        history.extend((0..6000).map(sample));
        assert_eq!(history.latest(), Some(sample(5999)));
        assert_eq!(history.since(MonotonicNs(5_990_000_000)).len(), 9);
        let state = history.at(MonotonicNs(5_000_250_000)).unwrap();
        assert!((state.q[3] - 5000.25).abs() < 1e-9);
        assert!(history.at(MonotonicNs(900_000_000)).is_none());
        assert!(history.at(MonotonicNs(6_000_000_000)).is_none());
    }
}
