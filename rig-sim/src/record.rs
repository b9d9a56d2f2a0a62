//! What really happened, as far back as anybody may ask: whole ropes for the
//! camera, tips for the truth.

use crate::render::ScenePose;
use arm_model::JointVector;
use nalgebra::Vector3;
use shared_types::ipc::message::SeenThrow;
use shared_types::{MonotonicNs, Task};
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Whole ropes kept, one per millisecond.
const ROPES_KEPT: usize = 2_000;
/// Tips kept, one per millisecond: a bit more than two minutes.
const TIPS_KEPT: usize = 130_000;

/// Arm and rope at one instant.
#[derive(Debug, Clone)]
pub(super) struct Snapshot {
    pub(super) at: MonotonicNs,
    pub(super) q: JointVector,
    pub(super) nodes: Vec<Vector3<f64>>,
    /// Whether the rope touched arm or column.
    pub(super) touched: bool,
    /// What it did with the bodies of a task.
    pub(super) bodies: Bodies,
}

/// Bodies of a task at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Bodies {
    /// Tilt of the domino (rad).
    pub(super) tilt_rad: f64,
    /// Whether it has fallen.
    pub(super) is_down: bool,
    /// Whether the rope has touched the first of them.
    pub(super) touched: bool,
}

/// What a throw is for, and where; nothing where there is none.
pub(super) type Placed = Option<(Task, Vector3<f64>)>;

#[derive(Debug, Clone, Copy)]
struct Tip {
    at: MonotonicNs,
    p_w_m: Vector3<f64>,
    middle_m: Vector3<f64>,
    touched: bool,
    bodies: Bodies,
}

/// The truth about a span of time.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Truth {
    pub(super) closest_m: f64,
    pub(super) closest_at: MonotonicNs,
    pub(super) peak_tip_speed_m_s: f64,
    pub(super) touched: bool,
    pub(super) seen: SeenThrow,
}

/// Period of the places that the truth tells (s).
const SEEN_PERIOD_S: f64 = 0.01;

#[derive(Debug, Default)]
struct Kept {
    ropes: VecDeque<Snapshot>,
    tips: VecDeque<Tip>,
    placed: Placed,
    /// What is to be placed, until physics has taken it.
    wanted: Option<Placed>,
    /// Why physics has not.
    refused: Option<String>,
}

/// Shared between physics (writes), camera and service (read).
#[derive(Debug, Default)]
pub(super) struct Record {
    kept: Mutex<Kept>,
    grown: Condvar,
}

impl Record {
    fn kept(&self) -> MutexGuard<'_, Kept> {
        // A panic elsewhere leaves whole snapshots behind.
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds snapshots, later than all before and in order.
    pub(super) fn extend(&self, snapshots: Vec<Snapshot>) {
        let mut kept = self.kept();
        for snapshot in snapshots {
            if let Some(p) = snapshot.nodes.last() {
                kept.tips.push_back(Tip {
                    at: snapshot.at,
                    p_w_m: *p,
                    middle_m: middle(&snapshot.nodes),
                    touched: snapshot.touched,
                    bodies: snapshot.bodies,
                });
            }
            kept.ropes.push_back(snapshot);
        }
        let surplus = kept.ropes.len().saturating_sub(ROPES_KEPT);
        kept.ropes.drain(..surplus);
        let surplus = kept.tips.len().saturating_sub(TIPS_KEPT);
        kept.tips.drain(..surplus);
        drop(kept);
        self.grown.notify_all();
    }

    /// Asks physics to place what a throw is for, and waits at most `patience` for it.
    ///
    /// # Errors
    /// In words: the rope hangs where a body would be, or physics does not answer.
    pub(super) fn place(&self, placed: Placed, patience: Duration) -> Result<(), String> {
        self.want(placed);
        let waits = |kept: &mut Kept| kept.wanted.is_some();
        let (mut kept, _) = self
            .grown
            .wait_timeout_while(self.kept(), patience, waits)
            .unwrap_or_else(PoisonError::into_inner);
        if waits(&mut kept) {
            return Err("the simulation does not answer; is the machine busy?".to_owned());
        }
        kept.refused.take().map_or(Ok(()), Err)
    }

    /// What physics is to place next.
    pub(super) fn want(&self, placed: Placed) {
        let mut kept = self.kept();
        (kept.wanted, kept.refused) = (Some(placed), None);
    }

    /// What is to be placed, if that is new.
    pub(super) fn wanted(&self) -> Option<Placed> {
        self.kept().wanted
    }

    /// Notes what became of what was wanted.
    pub(super) fn placed_as(&self, placed: Placed, outcome: Result<(), String>) {
        let mut kept = self.kept();
        kept.wanted = kept.wanted.filter(|newer| *newer != placed);
        match outcome {
            Ok(()) => kept.placed = placed,
            Err(why) => kept.refused = Some(why),
        }
        drop(kept);
        self.grown.notify_all();
    }

    /// What stands at the target.
    pub(super) fn placed(&self) -> Placed {
        self.kept().placed
    }

    /// Tilt of the domino at an instant (rad).
    pub(super) fn tilt_rad(&self, at: MonotonicNs) -> f64 {
        let kept = self.kept();
        let next = kept.ropes.partition_point(|m| m.at < at);
        let then = kept.ropes.get(next).or(kept.ropes.back());
        then.map_or(0.0, |then| then.bodies.tilt_rad)
    }

    /// Waits at most `patience` until physics has reached `at`; says whether.
    pub(super) fn wait_for(&self, at: MonotonicNs, patience: Duration) -> bool {
        let behind = |kept: &mut Kept| kept.ropes.back().is_none_or(|m| m.at < at);
        let (mut kept, _) = self
            .grown
            .wait_timeout_while(self.kept(), patience, behind)
            .unwrap_or_else(PoisonError::into_inner);
        !behind(&mut kept)
    }

    /// Arm and rope at `at`, linear between milliseconds; `None` outside the
    /// last two seconds.
    pub(super) fn pose_at(&self, at: MonotonicNs) -> Option<ScenePose> {
        let kept = self.kept();
        let next = kept.ropes.partition_point(|m| m.at < at);
        let after = kept.ropes.get(next)?;
        let before = kept.ropes.get(next.saturating_sub(1))?;
        if before.at > at {
            return None;
        }
        let span_s = after.at.since_s(before.at);
        let u = if span_s > 0.0 {
            at.since_s(before.at) / span_s
        } else {
            1.0
        };
        Some(ScenePose {
            q: before.q.zip_with(after.q, |a, b| a + u * (b - a)),
            nodes: before
                .nodes
                .iter()
                .zip(&after.nodes)
                .map(|(a, b)| a + (b - a) * u)
                .collect(),
        })
    }

    /// What happened from `from` to `to`, or a sentence saying why that is not
    /// known. Between milliseconds the tip moves straight: at 10 g that is off
    /// by 12 µm at most.
    pub(super) fn truth(&self, from: MonotonicNs, to: MonotonicNs) -> Result<Truth, String> {
        let kept = self.kept();
        let (_, target) = kept
            .placed
            .ok_or("there is no target; place one before asking how close the tip came")?;
        let (Some(first), Some(last)) = (kept.tips.front(), kept.tips.back()) else {
            return Err("nothing has happened yet; ask again a little later".to_owned());
        };
        if from < first.at {
            let kept_s = last.at.since_s(first.at);
            return Err(format!(
                "the span begins before what is kept ({kept_s:.0} s); request it sooner after the throw"
            ));
        }
        if to > last.at || to <= from {
            return Err("the span ends in the future or before it begins".to_owned());
        }
        let begin = kept.tips.partition_point(|t| t.at <= from).max(1) - 1;
        let end = (kept.tips.partition_point(|t| t.at < to) + 1).min(kept.tips.len());
        let mut truth = Truth {
            closest_m: f64::INFINITY,
            closest_at: from,
            peak_tip_speed_m_s: 0.0,
            touched: false,
            seen: SeenThrow::default(),
        };
        let next = kept.tips.range(begin + 1..end);
        for (a, b) in kept.tips.range(begin..end).zip(next) {
            truth.add(a, b, &target, (from, to));
        }
        truth.seen = seen(kept.tips.range(begin..end), from);
        Ok(truth)
    }
}

/// Middle of a rope of equal links, by its arc length (m).
fn middle(nodes: &[Vector3<f64>]) -> Vector3<f64> {
    let links = nodes.len().saturating_sub(1);
    let low = nodes.get(links / 2).copied().unwrap_or_default();
    let high = nodes.get(links.div_ceil(2)).copied().unwrap_or_default();
    (low + high) / 2.0
}

/// Where tip and middle were, every [`SEEN_PERIOD_S`], and what became of the bodies.
fn seen<'a>(tips: impl Iterator<Item = &'a Tip>, from: MonotonicNs) -> SeenThrow {
    let mut seen = SeenThrow::default();
    for tip in tips {
        let since_s = tip.at.since_s(from);
        let due_s = SEEN_PERIOD_S * seen.tip.len() as f64;
        if since_s >= due_s {
            seen.tip.push((since_s, tip.p_w_m.into()));
            seen.middle.push((since_s, tip.middle_m.into()));
        }
        seen.end_s = since_s;
        seen.domino_down = Some(tip.bodies.is_down);
        seen.touched = Some(tip.bodies.touched);
    }
    seen
}

impl Truth {
    /// Adds the tip's way from `a` to `b`, as far as it lies within the span.
    fn add(&mut self, a: &Tip, b: &Tip, target: &Vector3<f64>, span: (MonotonicNs, MonotonicNs)) {
        let step = b.p_w_m - a.p_w_m;
        let step_s = b.at.since_s(a.at);
        let low = (span.0.since_s(a.at) / step_s).clamp(0.0, 1.0);
        let high = (span.1.since_s(a.at) / step_s).clamp(0.0, 1.0);
        let nearest = (target - a.p_w_m).dot(&step) / step.norm_squared().max(1e-18);
        let u = nearest.clamp(low, high);
        let distance_m = (a.p_w_m + step * u - target).norm();
        if distance_m < self.closest_m {
            self.closest_m = distance_m;
            self.closest_at = a.at.plus_s(u * step_s);
        }
        self.peak_tip_speed_m_s = self.peak_tip_speed_m_s.max(step.norm() / step_s);
        self.touched |= a.touched || b.touched;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// A tip that passes (1, 0, 0) at 1 s with 5 m/s along y, 3 cm above it.
    fn passing() -> Record {
        let record = Record::default();
        let snapshots = (0..3000).map(|ms: u32| {
            let t_s = f64::from(ms) * 1e-3;
            let tip = Vector3::new(1.0, 5.0 * (t_s - 1.000_3), 0.03);
            Snapshot {
                at: MonotonicNs(u64::from(ms) * MS),
                q: JointVector::splat(t_s),
                nodes: vec![Vector3::zeros(), tip],
                touched: ms == 1500,
                bodies: Bodies {
                    is_down: ms > 1000,
                    ..Bodies::default()
                },
            }
        });
        record.extend(snapshots.collect());
        record
    }

    #[test]
    fn closest_approach_is_found_between_samples() {
        let record = passing();
        let ask = |from, to| record.truth(MonotonicNs(from * MS), MonotonicNs(to * MS));
        assert!(ask(500, 1200).unwrap_err().contains("no target"));
        record.placed_as(Some((Task::Strike, Vector3::x())), Ok(()));
        let truth = ask(500, 1200).unwrap();
        assert!((truth.closest_m - 0.03).abs() < 1e-12);
        assert!(truth.closest_at.0.abs_diff(1_000_300_000) < 1_000);
        assert!((truth.peak_tip_speed_m_s - 5.0).abs() < 1e-9);
        assert!(!truth.touched);
        assert_eq!(truth.seen.domino_down, Some(true));
        assert_eq!(ask(500, 900).unwrap().seen.domino_down, Some(false));
        let (since_s, [_, y_m, _]) = truth.seen.tip[40];
        assert!((y_m - 5.0 * (0.5 + since_s - 1.000_3)).abs() < 1e-9);
        assert!((truth.seen.middle[40].1[1] - y_m / 2.0).abs() < 1e-12);
        assert!(ask(500, 1600).unwrap().touched);
        // A span that ends early must not see what came later.
        let early = ask(500, 900).unwrap();
        assert!((early.closest_m - (5.0_f64 * 0.1003).hypot(0.03)).abs() < 1e-9);
        assert!(ask(500, 4000).is_err() && ask(900, 800).is_err());
    }

    #[test]
    fn poses_are_kept_for_two_seconds_and_mixed_between_samples() {
        let record = passing();
        let pose = record.pose_at(MonotonicNs(1500 * MS + MS / 4)).unwrap();
        assert!((pose.q[3] - 1.500_25).abs() < 1e-12);
        assert!((pose.nodes[1].y - 5.0 * (1.500_25 - 1.000_3)).abs() < 1e-9);
        assert!(record.pose_at(MonotonicNs(900 * MS)).is_none());
        assert!(record.pose_at(MonotonicNs(3000 * MS)).is_none());
        assert!(record.wait_for(MonotonicNs(2999 * MS), Duration::ZERO));
        assert!(!record.wait_for(MonotonicNs(3000 * MS), Duration::ZERO));
    }
}
