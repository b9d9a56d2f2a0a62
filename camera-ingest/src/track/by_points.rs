//! The rope from points that somebody else followed.
//!
//! The points stand in for the frame-by-frame measuring only: the curve through
//! them is smoothed, held at the clamp, kept at the rope's length and given up
//! where too little of it is seen or its length is another rope's.

use super::curve::{add, length, resample, scale, smooth, sub};
use super::follow::{
    ANCHOR, Follower, LEAST_LEAD, LOST_BELOW, NODES, SMOOTHING, UNSEEN_WEIGHT, mean,
};
use super::models::{ModelError, PointTracker, SeenPoint, check_count};
use super::plane::Point;
use super::state::State;
use crate::frame::EyeFrame;

/// Points asked for where the tracker follows any number.
const POINTS: usize = 32;
/// Part of the length by which the curve through the points may differ before the
/// frame is lost.
const OTHER_LENGTH: f64 = 0.15;

/// The rope in every frame, from its state in the first one.
pub(super) fn follow(
    follower: &Follower<'_>,
    frames: &[EyeFrame],
    times_s: &[f64],
    first: State,
    tracker: &mut dyn PointTracker,
) -> Result<Vec<State>, ModelError> {
    let count = tracker.points().unwrap_or(POINTS).max(2);
    let points: Vec<[f64; 2]> = resample(&first.curve, length(&first.curve), count)
        .iter()
        .map(|p| follower.plane.to_pixel(*p))
        .collect();
    let seen = tracker.follow(frames, &points)?;
    check_count("frames", seen.len(), frames.len())?;
    for seen in &seen {
        check_count("points of a frame", seen.len(), count)?;
    }
    let mut states = vec![first];
    for (seen, &t_s) in seen.iter().zip(times_s).skip(1) {
        let next = state(follower, seen, t_s, &states[states.len() - 1]);
        states.push(next);
    }
    Ok(states)
}

/// The curve through the points of one frame.
fn state(follower: &Follower<'_>, seen: &[SeenPoint], t_s: f64, before: &State) -> State {
    let points: Vec<Point> = seen
        .iter()
        .map(|s| follower.plane.point_at(s.pixel))
        .collect();
    let visible: Vec<f64> = seen.iter().map(|s| s.visible).collect();
    let confidence: Vec<f64> = (0..NODES)
        .map(|node| between(&visible, node, |a, b, part| a + (b - a) * part))
        .collect();
    let mut places: Vec<Point> = (0..NODES)
        .map(|node| between(&points, node, |a, b, part| add(a, scale(sub(b, a), part))))
        .collect();
    let mut weights: Vec<f64> = confidence
        .iter()
        .map(|c| (c * c).max(UNSEEN_WEIGHT))
        .collect();
    places[0] = follower.clamp_at(t_s);
    weights[0] = ANCHOR;
    let fitted = smooth(&places, &weights, SMOOTHING);
    let lead_seen = confidence[NODES - 1] > LEAST_LEAD;
    let off = (length(&fitted) / follower.model.length_m - 1.0).abs();
    let long = follower.plausible_length(length(&fitted), lead_seen);
    let curve = resample(&fitted, long, NODES);
    let lost = mean(&confidence) < LOST_BELOW || off > OTHER_LENGTH;
    let dt = t_s - before.t_s;
    let velocity = curve
        .iter()
        .zip(&before.curve)
        .map(|(now, then)| scale(sub(*now, *then), 1.0 / dt))
        .collect();
    State {
        t_s,
        curve,
        velocity,
        confidence,
        lost,
        hidden: false,
        ambiguous: false,
        clamp: None,
    }
}

/// Value at a node of the curve from values spread evenly along it.
fn between<T: Copy>(values: &[T], node: usize, mix: impl Fn(T, T, f64) -> T) -> T {
    let at = node as f64 * (values.len() - 1) as f64 / (NODES - 1) as f64;
    let left = (at as usize).min(values.len() - 2);
    mix(values[left], values[left + 1], at - left as f64)
}
