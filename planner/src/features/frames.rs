//! Keypoints of a recording on the network's own grid of times and places.

use super::alignment::{Sway, delay_s};
use super::definition::{FeatureDefinition, ObserveError};
use super::plane::PlaneView;
use crate::observation::ObservedPoints;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};

/// Keypoints below this confidence count as not seen.
const CONFIDENCE_MIN: f64 = 0.2;
/// Longest row of unseen keypoints that their neighbours stand in for.
const GAP_KEYPOINTS_MAX: usize = 2;
/// Longest time between two seen frames across which is interpolated, in frames
/// of the grid.
const GAP_FRAMES_MAX: f64 = 2.5;

/// Forward, up (m) and exposure (s) of a point in the plane.
type Exposed = [f64; 3];
/// Forward and up (m) of a frame's keypoints, of link centres those there are; `None`
/// where it was not seen.
pub(super) type Frame = Option<Vec<[f64; 2]>>;

/// Keypoints at the grid's times, those of the wiggle.
pub(super) fn on_grid(
    definition: &FeatureDefinition,
    track: &KeypointTrack,
    camera: &StereoCamera,
    view: &PlaneView,
    sway: &Sway,
) -> Result<Vec<Frame>, ObserveError> {
    let seen: Vec<Vec<Exposed>> = track
        .frames
        .iter()
        .filter(|frame| !frame.lost)
        .filter_map(|frame| see(frame, definition, camera, view))
        .collect();
    enough(seen.len(), definition)?;
    let start_s = track.frames.first().map_or(0.0, |f| f.t_s);
    let clamp: Vec<[f64; 2]> = seen.iter().map(|s| [s[0][2] - start_s, s[0][0]]).collect();
    let first_s = start_s + delay_s(&clamp, sway)?;
    let frame_s = 1.0 / definition.rate_hz;
    let mut next = 0;
    let at = |i| {
        let t_s = first_s + i as f64 / definition.rate_hz;
        while next < seen.len() && seen[next][0][2] <= t_s {
            next += 1;
        }
        let keypoints = 0..seen[0].len();
        keypoints
            .map(|k| at_time(&seen, next, k, t_s, frame_s))
            .collect()
    };
    let frames: Vec<Frame> = (0..definition.frames).map(at).collect();
    enough(frames.iter().flatten().count(), definition)?;
    Ok(frames)
}

/// Refuses a rope seen in less than a quarter of the frames.
fn enough(seen: usize, definition: &FeatureDefinition) -> Result<(), ObserveError> {
    let (frames, min) = (definition.frames, definition.frames / 4);
    if seen >= min {
        return Ok(());
    }
    Err(ObserveError::new(format!(
        "the rope was seen in {seen} of {frames} frames at 60 Hz, the network needs {min}: film again with the whole rope in view"
    )))
}

/// All channels, as the table in the module's documentation says.
pub(super) fn channels(definition: &FeatureDefinition, frames: &[Frame]) -> Vec<f32> {
    let mut mean = [0.0; 2];
    let seen = frames.iter().flatten().count().max(1) as f64;
    for points in frames.iter().flatten() {
        for axis in 0..2 {
            mean[axis] += points[0][axis] / seen;
        }
    }
    let channels = definition.channels();
    let mut out = Vec::with_capacity(frames.len() * channels);
    for frame in frames {
        let begin = out.len();
        let Some(points) = frame else {
            out.resize(begin + channels, 0.0);
            continue;
        };
        let first = points[0];
        let relative = points.iter().enumerate().flat_map(|(k, p)| {
            let reference = if k == 0 { mean } else { first };
            [p[0] - reference[0], p[1] - reference[1]]
        });
        out.extend(relative.map(|x| x as f32));
        // Links that the rope does not have.
        out.resize(begin + 2 * definition.keypoints, 0.0);
        let mut before: f64 = 0.0;
        for pair in points.windows(2) {
            let angle = (pair[1][0] - pair[0][0]).atan2(pair[0][1] - pair[1][1]);
            let turn = (angle - before).rem_euclid(core::f64::consts::TAU);
            let turn = if turn > core::f64::consts::PI {
                turn - core::f64::consts::TAU
            } else {
                turn
            };
            before += turn;
            out.push(before as f32);
        }
        out.resize(begin + channels - 1, 0.0);
        out.push(1.0);
    }
    out
}

/// One frame's keypoints in the plane, at the grid's places along the rope.
fn see(
    frame: &TrackedFrame,
    definition: &FeatureDefinition,
    camera: &StereoCamera,
    view: &PlaneView,
) -> Option<Vec<Exposed>> {
    let found: Vec<Option<Exposed>> = frame
        .points
        .iter()
        .zip(&frame.confidence)
        .map(|(pixel, confidence)| {
            let [forward, up] = view.point(camera.left.undistort(*pixel))?;
            let time_s = frame.t_s + camera.row_time_s(pixel[1]);
            (*confidence >= CONFIDENCE_MIN).then_some([forward, up, time_s])
        })
        .collect();
    let whole = bridge(&found)?;
    if definition.points == ObservedPoints::LinkCentres {
        return Some(whole);
    }
    let keypoints = definition.keypoints;
    let at_keypoint = |k| {
        let place = k as f64 / (keypoints - 1) as f64 * (whole.len() - 1) as f64;
        let before = (place as usize).min(whole.len() - 2);
        mix(whole[before], whole[before + 1], place - before as f64)
    };
    Some((0..keypoints).map(at_keypoint).collect())
}

/// Fills short gaps between seen keypoints; `None` if an end or a longer row is
/// missing.
fn bridge(found: &[Option<Exposed>]) -> Option<Vec<Exposed>> {
    let mut out: Vec<Exposed> = Vec::with_capacity(found.len());
    for (index, point) in found.iter().enumerate() {
        let Some(point) = point else { continue };
        let gap = index - out.len();
        if gap > GAP_KEYPOINTS_MAX {
            return None;
        }
        for i in 1..=gap {
            let before = *out.last()?;
            // Each step goes the same part of the way that is left.
            out.push(mix(before, *point, 1.0 / (gap + 2 - i) as f64));
        }
        out.push(*point);
    }
    (out.len() == found.len()).then_some(out)
}

fn mix(a: Exposed, b: Exposed, part: f64) -> Exposed {
    core::array::from_fn(|i| a[i] + (b[i] - a[i]) * part)
}

/// Keypoint `k` at a time, from the frames around it; `hint` is a frame near it.
/// A frame stands in for times within a frame of it where the recording begins or
/// ends or has a longer gap.
fn at_time(
    seen: &[Vec<Exposed>],
    hint: usize,
    k: usize,
    t_s: f64,
    frame_s: f64,
) -> Option<[f64; 2]> {
    let time_s = |i: usize| seen[i][k][2];
    let mut after = hint.min(seen.len());
    while after > 0 && time_s(after - 1) > t_s {
        after -= 1;
    }
    while after < seen.len() && time_s(after) <= t_s {
        after += 1;
    }
    let before = after.checked_sub(1).map(|i| seen[i][k]);
    let after = seen.get(after).map(|s| s[k]);
    let place = |p: Exposed| [p[0], p[1]];
    let near = |p: &Exposed| (p[2] - t_s).abs() < frame_s;
    match (before, after) {
        (Some(a), Some(b)) if b[2] - a[2] <= GAP_FRAMES_MAX * frame_s => {
            Some(place(mix(a, b, (t_s - a[2]) / (b[2] - a[2]))))
        }
        (a, b) => a.filter(near).or(b.filter(near)).map(place),
    }
}
