//! What the control loop did and was told, and what that shows of the arm.

use arm_model::JointVector;
use shared_types::MonotonicNs;
use shared_types::ipc::{CycleRecord, JointReport};

/// Reports closer than this are one and the same (the fastest come every 4 ms).
const SAME_REPORT_NS: u64 = 1_000_000;
/// Largest lag looked for (ms).
const LAG_MAX_MS: u32 = 120;

/// Control cycles and joint reports.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cycles {
    /// Control cycles in order.
    pub cycles: Vec<CycleRecord>,
    /// Joint reports as they came.
    pub joints: Vec<JointReport>,
}

impl Cycles {
    /// Joint reports in order of time, each once: one is sent at once to a new listener and
    /// may repeat the last.
    pub fn reports(&self) -> Vec<JointReport> {
        let mut out = self.joints.clone();
        out.sort_by_key(|r| r.stamp_ns);
        out.dedup_by(|next, kept| next.stamp_ns - kept.stamp_ns < SAME_REPORT_NS);
        out
    }

    /// Measured joints between two instants (CLOCK_MONOTONIC ns, rad), in order of time.
    pub fn joints_between(&self, from_ns: u64, to_ns: u64) -> Vec<(u64, JointVector)> {
        let reports = self.reports().into_iter().map(|r| (r.stamp_ns, r.q));
        reports
            .filter(|(at_ns, _)| (from_ns..=to_ns).contains(at_ns))
            .collect()
    }

    /// How late `joint` (0-based) follows its setpoints in a motion between two instants
    /// (s, to a millisecond); `None` when it did not move enough to tell.
    pub fn joint_lag_s(&self, joint: usize, [start_ns, end_ns]: [u64; 2]) -> Option<f64> {
        // Before the arm was taken over there is no command to follow.
        let setpoints: Vec<(u64, f64)> = self
            .cycles
            .iter()
            .filter(|c| (start_ns..=end_ns).contains(&c.deadline_ns))
            .map(|c| (instant_ns(c, start_ns), c.q_c[joint]))
            .collect();
        let (first_ns, last_ns) = (setpoints.first()?.0, setpoints.last()?.0);
        let q = || setpoints.iter().map(|s| s.1);
        if q().fold(f64::MIN, f64::max) - q().fold(f64::MAX, f64::min) < 0.02 {
            return None;
        }
        let ns = |ms: u32| u64::from(ms) * 1_000_000;
        let within = first_ns + ns(LAG_MAX_MS) + 1..last_ns;
        let seen: Vec<&JointReport> = self
            .joints
            .iter()
            .filter(|r| within.contains(&r.stamp_ns))
            .collect();
        let misfit = |lag_ms: u32| {
            let (mut sum, mut count) = (0.0, 0u32);
            for r in &seen {
                if let Some(q) = interpolated(&setpoints, r.stamp_ns - ns(lag_ms)) {
                    sum += (r.q[joint] - q).powi(2);
                    count += 1;
                }
            }
            if count < 50 {
                f64::INFINITY
            } else {
                sum / f64::from(count)
            }
        };
        let best = (0..=LAG_MAX_MS).min_by(|a, b| misfit(*a).total_cmp(&misfit(*b)))?;
        misfit(best).is_finite().then(|| f64::from(best) * 1e-3)
    }
}

/// The instant that a cycle's setpoint is for: a late one is not for its deadline.
fn instant_ns(cycle: &CycleRecord, start_ns: u64) -> u64 {
    if cycle.trajectory_s >= 0.0 && cycle.speed_override >= 1.0 {
        MonotonicNs(start_ns).plus_s(cycle.trajectory_s).0
    } else {
        cycle.deadline_ns
    }
}

fn interpolated(setpoints: &[(u64, f64)], at_ns: u64) -> Option<f64> {
    let after = setpoints.partition_point(|s| s.0 <= at_ns);
    let (a, b) = (setpoints.get(after.checked_sub(1)?)?, setpoints.get(after)?);
    let span = b.0.checked_sub(a.0)? as f64;
    Some(a.1 + (at_ns - a.0) as f64 / span * (b.1 - a.1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planted_lag_is_found() {
        const BEGIN_NS: u64 = 1_000_000_000;
        let at = |t: f64| 0.3 * (5.0 * t).sin();
        let mut reported = Cycles::default();
        for i in 0..1500 {
            let mut cycle = CycleRecord {
                deadline_ns: BEGIN_NS + i * 4_000_000,
                ..CycleRecord::default()
            };
            cycle.q_c[5] = at(i as f64 * 4e-3);
            reported.cycles.push(cycle);
        }
        for i in 0..1400 {
            let t = i as f64 * 4.1e-3;
            let mut report = JointReport {
                stamp_ns: BEGIN_NS + (t * 1e9) as u64,
                ..JointReport::default()
            };
            report.q[5] = at(t - 0.023);
            reported.joints.push(report);
        }
        let span = [BEGIN_NS, u64::MAX];
        assert_eq!(reported.joint_lag_s(5, span), Some(0.023));
        assert_eq!(reported.joint_lag_s(2, span), None, "joint 3 did not move");
    }
}
