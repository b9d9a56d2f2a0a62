//! What came at its own times, looked up at others.

use arm_model::JointVector;

/// Samples in order of time (CLOCK_MONOTONIC, ns).
#[derive(Debug)]
pub(super) struct Samples<T>(Vec<(u64, T)>);

impl<T: Copy> Samples<T> {
    /// Samples as they came.
    pub(super) fn new(came: impl Iterator<Item = (u64, T)>) -> Self {
        let mut samples: Vec<(u64, T)> = came.collect();
        samples.sort_by_key(|(at_ns, _)| *at_ns);
        Self(samples)
    }

    /// Their instants.
    pub(super) fn instants(&self) -> impl Iterator<Item = u64> {
        self.0.iter().map(|(at_ns, _)| *at_ns)
    }

    /// The first and the last instant, where there are any.
    pub(super) fn ends(&self) -> Option<[u64; 2]> {
        Some([self.0.first()?.0, self.0.last()?.0])
    }

    /// The newest one at an instant.
    pub(super) fn newest(&self, at_ns: u64) -> Option<(u64, T)> {
        let after = self.0.partition_point(|(t, _)| *t <= at_ns);
        self.0.get(after.checked_sub(1)?).copied()
    }

    /// The one nearest to an instant, at most `within_ns` away.
    pub(super) fn nearest(&self, at_ns: u64, within_ns: u64) -> Option<T> {
        let next = self.0.partition_point(|(t, _)| *t < at_ns);
        let around = self.0[next.saturating_sub(1)..].iter().take(2);
        let (t, value) = around.min_by_key(|(t, _)| t.abs_diff(at_ns))?;
        (t.abs_diff(at_ns) <= within_ns).then_some(*value)
    }

    /// The median time from one to the next (ns); `None` of fewer than two.
    pub(super) fn period_ns(&self) -> Option<u64> {
        let mut steps: Vec<u64> = self.steps(0, u64::MAX).collect();
        steps.sort_unstable();
        steps.get(steps.len() / 2).copied()
    }

    /// The times from one to the next between two instants (ns).
    pub(super) fn steps(&self, from_ns: u64, to_ns: u64) -> impl Iterator<Item = u64> {
        let within = move |pair: &&[(u64, T)]| pair[1].0 > from_ns && pair[0].0 < to_ns;
        let pairs = self.0.windows(2).filter(within);
        pairs.map(|pair| pair[1].0 - pair[0].0)
    }
}

impl Samples<JointVector> {
    /// Linearly interpolated between two samples; the first and the last one hold beyond.
    pub(super) fn between(&self, at_ns: u64) -> Option<JointVector> {
        let after = self.0.partition_point(|(t, _)| *t <= at_ns);
        let (from, to) = (self.0.get(after.saturating_sub(1))?, self.0.get(after));
        let (Some(to), true) = (to, after > 0) else {
            return Some(from.1);
        };
        let part = (at_ns - from.0) as f64 / (to.0 - from.0) as f64;
        Some(from.1 + (to.1 - from.1) * part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_between_is_found_from_both_sides() {
        let samples = Samples::new([(30, 'c'), (10, 'a'), (20, 'b')].into_iter());
        let newest = [9, 10, 19, 99].map(|at| samples.newest(at).map(|(_, v)| v));
        assert_eq!(newest, [None, Some('a'), Some('a'), Some('c')]);
        let nearest = [0, 6, 14, 16, 34, 35].map(|at| samples.nearest(at, 4));
        assert_eq!(
            nearest,
            [None, Some('a'), Some('a'), Some('b'), Some('c'), None]
        );
    }

    #[test]
    fn joints_are_interpolated_and_hold_at_the_ends() {
        let at = |q| JointVector::splat(q);
        let samples = Samples::new([(100, at(1.0)), (200, at(3.0))].into_iter());
        let found = [0, 100, 125, 200, 300].map(|t| samples.between(t).unwrap()[6]);
        assert_eq!(found, [1.0, 1.0, 1.5, 3.0, 3.0]);
    }

    #[test]
    fn one_late_sample_changes_the_longest_step_alone() {
        let late = [0, 33, 66, 99, 399, 432, 465].map(|ms| (ms, ()));
        let samples = Samples::new(late.into_iter());
        assert_eq!(samples.period_ns(), Some(33));
        let longest = [(0, 500), (0, 90), (420, 500), (200, 300)];
        let longest = longest.map(|(from, to)| samples.steps(from, to).max().unwrap());
        assert_eq!(longest, [300, 33, 33, 300]);
        assert_eq!(Samples::new([(1, ())].into_iter()).period_ns(), None);
    }
}
