//! Lobs and drapes that were made, judged by the places in which tip and middle were seen: by
//! a camera, or by a simulation that knows them.

use super::drape::TOUCHED;
use super::{ThrowGoal, ThrowOutcome};
use arm_model::Cell;
use nalgebra::Vector3;
use rope_sim::{
    BoxRegion, ClosestApproach, ContactSummary, DominoOutcome, Dwell, RestMeasures, RopePart,
    TaskFrame,
};
use shared_types::ipc::message::SeenThrow;
use shared_types::{RopeParams, Verdict};

/// Longest time for which the tip may be unseen while it must be at rest (s).
const UNSEEN_S: f64 = 0.3;

/// What a throw that was made came to.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenVerdict {
    /// By the conditions of the task that could be seen.
    pub verdict: Verdict,
    /// The task's error (m); `None` where it takes the rope's middle, which was not seen.
    pub error_m: Option<f64>,
}

/// Judges a throw by the same conditions as a simulated one, as far as they were seen. `rope` tells
/// the radius of its lead, `clamp_m` where it is held at the end: a rope at rest that is held
/// before a wall and hangs beyond it lies on the wall, whether that was seen or not.
///
/// # Errors
/// In words: the tip was not seen, or not while it must have been at rest.
pub fn judge_seen(
    goal: &ThrowGoal,
    (rope, clamp_m): (&RopeParams, [f64; 3]),
    cell: &Cell,
    seen: &SeenThrow,
) -> Result<SeenVerdict, String> {
    let task = goal.task();
    let watch = task.watch(rope, cell);
    let window_s = seen.end_s - watch.rest_window_s.unwrap_or_default();
    let within = seen.tip.iter().map(|(time_s, _)| *time_s);
    let within = within.filter(|time_s| *time_s > window_s);
    let mut last_s = window_s;
    for next_s in within.chain([seen.end_s]) {
        if next_s - last_s > UNSEEN_S {
            return Err(format!(
                "the tip was not seen for {:.1} s while it must be at rest: let the camera see where it comes to rest",
                next_s - last_s
            ));
        }
        last_s = next_s;
    }
    let mut outcome = ThrowOutcome {
        finite: true,
        end_s: seen.end_s,
        point_m: watch.point_m.unwrap_or_default(),
        segment_m: watch.segment_m.unwrap_or_default(),
        ..ThrowOutcome::default()
    };
    let to_point = watch
        .point_m
        .map(|at| approach(&seen.tip, [at, at]).distance_m);
    outcome.closest_m = to_point.unwrap_or_default();
    outcome.watched.dwell = watch.dwell_in.map(|region| dwell(&region, seen));
    outcome.watched.to_segment = watch.segment_m.map(|ends| approach(&seen.tip, ends));
    outcome.watched.rest = rest(seen, window_s);
    // Whether it fell is known, when it fell is not.
    outcome.domino = Some(DominoOutcome {
        down_at_s: (seen.domino_down == Some(true)).then_some(seen.end_s),
        peak_tilt_rad: 0.0,
    });
    let local = |at_m| TaskFrame::at(task.target_m()).local(at_m);
    let is_held_before = local(clamp_m)[0] < -cell.wall.size_m[0] / 2.0;
    let hangs_beyond = || {
        let outcome = ThrowOutcome {
            obstacles: vec![ContactSummary::default()],
            ..outcome.clone()
        };
        let conditions = task.judge(rope, &outcome).conditions;
        conditions
            .iter()
            .filter(|c| c.name != TOUCHED)
            .all(|c| c.met)
    };
    let touched = seen
        .touched
        .or_else(|| (is_held_before && hangs_beyond()).then_some(true));
    let is_touch_unseen = touched.is_none();
    let touched = touched == Some(true);
    outcome.obstacles = vec![ContactSummary {
        first: touched.then_some((seen.end_s, RopePart::Links)),
    }];
    let mut verdict = task.judge(rope, &outcome);
    // A fallen domino counts as a hit.
    let is_unseen = |name: &str, met: bool| match name {
        "domino down" => seen.domino_down.is_none(),
        "target hit" => seen.domino_down.is_none() && !met,
        TOUCHED => is_touch_unseen,
        _ => false,
    };
    let (unseen, known): (Vec<_>, Vec<_>) = verdict
        .conditions
        .into_iter()
        .partition(|condition| is_unseen(&condition.name, condition.met));
    verdict.unseen = unseen.into_iter().map(|condition| condition.name).collect();
    verdict.success = verdict.unseen.is_empty() && known.iter().all(|condition| condition.met);
    verdict.conditions = known;
    let is_unknown = matches!(goal, ThrowGoal::Drape(_)) && seen.middle.is_empty();
    let error_m = (!is_unknown).then(|| task.error_m(&outcome));
    Ok(SeenVerdict { verdict, error_m })
}

/// Between two places the tip counts as where it was last. One place outside between two inside
/// is taken for an error of the camera.
fn dwell(region: &BoxRegion, seen: &SeenThrow) -> Dwell {
    let (mut total_s, mut inside_since_s) = (0.0, None);
    let inside: Vec<bool> = seen
        .tip
        .iter()
        .map(|(_, at)| region.contains(*at))
        .collect();
    let at = |k: usize| inside.get(k).copied().unwrap_or(true);
    let is_inside = |k: usize| inside[k] || (k > 0 && inside[k - 1] && at(k + 1));
    let next_s = seen.tip.iter().skip(1).map(|(time_s, _)| *time_s);
    for (k, ((time_s, _), until_s)) in seen.tip.iter().zip(next_s.chain([seen.end_s])).enumerate() {
        if is_inside(k) {
            total_s += until_s - time_s;
            inside_since_s.get_or_insert(*time_s);
        } else {
            inside_since_s = None;
        }
    }
    Dwell {
        total_s,
        inside_since_s,
    }
}

/// Between two places the tip moves straight.
fn approach(tip: &[(f64, [f64; 3])], ends: [[f64; 3]; 2]) -> ClosestApproach {
    /// Places that are looked at between two.
    const PIECES: u32 = 16;
    let [a, b] = ends.map(Vector3::from);
    let along = b - a;
    let distance_m = |p: &Vector3<f64>| {
        let u = (p - a).dot(&along) / along.norm_squared().max(1e-18);
        (p - a - along * u.clamp(0.0, 1.0)).norm()
    };
    let mut best = ClosestApproach {
        distance_m: f64::INFINITY,
        time_s: 0.0,
        tip_m: [0.0; 3],
        velocity_m_s: [0.0; 3],
    };
    for pair in tip.windows(2) {
        let [(from_s, from), (to_s, to)] = [pair[0], pair[1]];
        let (from, way) = (Vector3::from(from), Vector3::from(to) - Vector3::from(from));
        for piece in 0..=PIECES {
            let u = f64::from(piece) / f64::from(PIECES);
            let at = from + way * u;
            let distance_m = distance_m(&at);
            if distance_m < best.distance_m {
                best = ClosestApproach {
                    distance_m,
                    time_s: from_s + u * (to_s - from_s),
                    tip_m: at.into(),
                    velocity_m_s: (way / (to_s - from_s).max(1e-9)).into(),
                };
            }
        }
    }
    best
}

/// A middle that is not seen does not move, as far as anybody knows.
fn rest(seen: &SeenThrow, from_s: f64) -> Option<RestMeasures> {
    let spread = |places: &[(f64, [f64; 3])]| {
        let within = places.iter().filter(|(time_s, _)| *time_s >= from_s);
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = -low;
        for (_, at) in within {
            (low, high) = (low.inf(&Vector3::from(*at)), high.sup(&Vector3::from(*at)));
        }
        high - low
    };
    let middle_m = seen.middle.last().map(|(_, at)| *at);
    let moved_m = middle_m.map_or(0.0, |_| spread(&seen.middle).norm());
    Some(RestMeasures {
        tip_height_spread_m: spread(&seen.tip).z,
        middle_movement_m: moved_m,
        tip_m: seen.tip.last()?.1,
        middle_m: middle_m.unwrap_or_default(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlannerConfig;
    use arm_model::{JointTrajectory, JointVector};
    use shared_types::Task;

    const TARGET_M: [f64; 3] = [0.8, 0.0, 0.2];

    fn rope() -> RopeParams {
        RopeParams::from_array([22.0, 0.55, 0.02, 0.3, 0.008, 0.06, 0.06, 0.03, 0.8])
    }

    /// Seen 60 times a second for 4 s.
    fn seen(tip: impl Fn(f64) -> [f64; 3]) -> SeenThrow {
        let times = (0..=240).map(|k| f64::from(k) / 60.0);
        SeenThrow {
            end_s: 4.0,
            tip: times.map(|t_s| (t_s, tip(t_s))).collect(),
            middle: Vec::new(),
            domino_down: Some(true),
            touched: None,
        }
    }

    fn judge(task: Task, seen: &SeenThrow) -> Result<SeenVerdict, String> {
        let settings = PlannerConfig::default();
        let goal = settings.goal(task, TARGET_M);
        judge_seen(&goal, (&rope(), [0.5, 0.0, 0.6]), &settings.cell, seen)
    }

    #[test]
    fn a_lob_stays_a_second_or_fails() {
        // From before the board onto it, 2 cm above (the lead's radius is 3 cm).
        let arrives = |at_s: f64| move |t_s: f64| [if t_s < at_s { 0.5 } else { 0.82 }, 0.0, 0.23];
        let lies = judge(Task::Lob, &seen(arrives(2.5))).unwrap();
        assert!(lies.verdict.success, "{lies:?}");
        // On its way it passes through the very point.
        assert!(lies.error_m.unwrap() < 1e-9, "{lies:?}");
        let late = judge(Task::Lob, &seen(arrives(3.2))).unwrap().verdict;
        assert!(!late.success && late.conditions.len() == 3, "{late:?}");
        let mut beside = seen(arrives(2.5));
        beside.domino_down = None;
        let judged = judge(Task::Lob, &beside).unwrap().verdict;
        assert!(
            !judged.success && judged.unseen == ["domino down"],
            "{judged:?}"
        );
        let said = judged.to_string();
        assert!(
            said.starts_with("not known") && said.contains("not seen: domino"),
            "{said}"
        );
        beside.tip.retain(|(time_s, _)| *time_s < 3.6);
        assert!(judge(Task::Lob, &beside).unwrap_err().contains("0.4 s"));
        // One error of the camera does not end a stay, two do.
        let mut noisy = seen(arrives(2.5));
        noisy.tip[220].1 = [0.0; 3];
        assert!(judge(Task::Lob, &noisy).unwrap().verdict.success);
        noisy.tip[221].1 = [0.0; 3];
        assert!(!judge(Task::Lob, &noisy).unwrap().verdict.success);
    }

    #[test]
    fn a_film_that_ends_before_the_rope_must_be_at_rest_is_refused() {
        let settings = PlannerConfig::default();
        let goal = settings.goal(Task::Lob, TARGET_M);
        let still = [JointVector::default(); 2];
        let motion = JointTrajectory::new(&[0.0, 0.5], &still).unwrap();
        let until_s = goal.observed_s(&motion);
        let judge = |until_s: f64| {
            let mut film = seen(|t_s| [if t_s < 1.5 { 0.5 } else { 0.82 }, 0.0, 0.23]);
            film.tip.retain(|(t_s, _)| *t_s <= until_s);
            film.end_s = until_s;
            goal.judge_film((&motion, &rope()), &settings.cell, &film)
        };
        let whole = judge(until_s).unwrap();
        assert!(whole.success, "{whole:?}");
        let short = judge(until_s - 0.2).unwrap_err();
        assert!(short.contains("is it this throw's film"), "{short}");
    }

    #[test]
    fn a_drape_hangs_beyond_the_wall_at_rest_or_fails() {
        let hangs = |swing_m: f64| {
            move |t_s: f64| {
                let x = if t_s < 2.0 { 0.6 } else { 0.84 };
                [x, 0.0, 0.05 + swing_m * (9.0 * t_s).sin()]
            }
        };
        let mut still = seen(hangs(0.01));
        let judged = judge(Task::Drape, &still).unwrap();
        assert!(judged.verdict.success && judged.error_m.is_none());
        // Held before the wall, hanging beyond it.
        assert_eq!(judged.verdict.conditions.len(), 4);
        assert!(
            !judge(Task::Drape, &seen(hangs(0.04)))
                .unwrap()
                .verdict
                .success
        );
        still.middle = vec![(0.0, [0.0; 3]), (4.0, [0.81, 0.0, 0.2])];
        still.touched = Some(true);
        let known = judge(Task::Drape, &still).unwrap();
        assert_eq!(known.verdict.conditions.len(), 4);
        assert!((known.error_m.unwrap() - 0.01).abs() < 1e-12, "{known:?}");
    }
}
