//! How late the arm follows its setpoints, from commanded and measured joints
//! on one clock.

use super::arm::MotionSpan;
use crate::session::Recorder;
use shared_types::MonotonicNs;
use shared_types::ipc::{CycleRecord, JointReport};

/// Largest lag looked for (ms).
const LAG_MAX_MS: u32 = 120;

/// Delay (s) between commanded and measured position of `joint` (0-based) over a
/// motion, see [`lag_s`].
pub fn joint_lag_s(recorder: &Recorder, motion: &MotionSpan, joint: usize) -> Option<f64> {
    // Before the arm was taken over there is no command to follow.
    let during = |ns: u64| (motion.start_ns..=motion.end_ns).contains(&ns);
    let cycles: Vec<CycleRecord> = recorder
        .cycles
        .iter()
        .filter(|c| during(c.deadline_ns))
        .map(|c| dated(c, motion.start_ns))
        .collect();
    lag_s(&cycles, &recorder.joints, joint)
}

/// A cycle dated by the instant that its setpoint is for: a late one is not for its
/// deadline.
fn dated(cycle: &CycleRecord, start_ns: u64) -> CycleRecord {
    let followed = cycle.trajectory_s >= 0.0 && cycle.path_rate >= 1.0;
    CycleRecord {
        deadline_ns: if followed {
            MonotonicNs(start_ns).plus_s(cycle.trajectory_s).0
        } else {
            cycle.deadline_ns
        },
        ..*cycle
    }
}

/// Delay (s) that explains a recording best, to a millisecond; `None` when the
/// joint did not move enough to tell.
fn lag_s(cycles: &[CycleRecord], reports: &[JointReport], joint: usize) -> Option<f64> {
    let (first, last) = (cycles.first()?, cycles.last()?);
    let moved = cycles
        .iter()
        .map(|c| c.q_c[joint])
        .fold((f64::MAX, f64::MIN), |(lo, hi), q| (lo.min(q), hi.max(q)));
    if moved.1 - moved.0 < 0.02 {
        return None;
    }
    let commanded = |at_ns: u64| {
        let after = cycles.partition_point(|c| c.deadline_ns <= at_ns);
        let (a, b) = (cycles.get(after.checked_sub(1)?)?, cycles.get(after)?);
        let span = b.deadline_ns.checked_sub(a.deadline_ns)? as f64;
        let part = (at_ns - a.deadline_ns) as f64 / span;
        Some(a.q_c[joint] + part * (b.q_c[joint] - a.q_c[joint]))
    };
    let misfit = |lag_ms: u32| {
        let lag_ns = u64::from(lag_ms) * 1_000_000;
        let mut sum = 0.0;
        let mut count = 0u32;
        for r in reports.iter().filter(|r| {
            r.stamp_ns > first.deadline_ns + u64::from(LAG_MAX_MS) * 1_000_000
                && r.stamp_ns < last.deadline_ns
        }) {
            if let Some(q) = commanded(r.stamp_ns - lag_ns) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planted_lag_is_found() {
        let at = |t: f64| 0.3 * (5.0 * t).sin();
        let cycles: Vec<CycleRecord> = (0..1500)
            .map(|i| {
                let mut c = CycleRecord {
                    deadline_ns: 1_000_000_000 + i * 4_000_000,
                    ..Default::default()
                };
                c.q_c[5] = at(i as f64 * 4e-3);
                c
            })
            .collect();
        let reports: Vec<JointReport> = (0..1400)
            .map(|i| {
                let t = i as f64 * 4.1e-3;
                let mut r = JointReport {
                    stamp_ns: 1_000_000_000 + (t * 1e9) as u64,
                    ..Default::default()
                };
                r.q[5] = at(t - 0.023);
                r
            })
            .collect();
        assert_eq!(lag_s(&cycles, &reports, 5), Some(0.023));
        assert_eq!(lag_s(&cycles, &reports, 2), None, "joint 3 did not move");
    }
}
