//! One frame of a film whose motion is known: what is drawn of it, and where moving points
//! appear in it.

use crate::render::{Renderer, ScenePose};
use nalgebra::Vector3;
use shared_types::StereoCamera;

/// Poses computed per exposure of a row; as many of them are drawn as the motion needs.
const POSES: usize = 8;

/// Poses evenly over the time of a frame that begins at `start_s`.
pub(crate) fn poses(
    camera: &StereoCamera,
    start_s: f64,
    pose_at: impl FnMut(f64) -> ScenePose,
) -> Vec<ScenePose> {
    let frame_s = camera.frame_time_s();
    let count = (POSES as f64 * frame_s / camera.exposure_s).ceil() as usize;
    let part = |i: usize| start_s + frame_s * (i as f64 + 0.5) / count as f64;
    (0..count).map(part).map(pose_at).collect()
}

/// Draws frame `sequence`, both eyes side by side in packed YUYV, of as many of its `poses`
/// as the motion needs.
pub(crate) fn draw(renderer: &mut Renderer, poses: &[ScenePose], sequence: u64) -> Vec<u8> {
    let needed = renderer.sub_frames(&poses[0], &poses[poses.len() - 1]);
    let count = needed.min(poses.len());
    // Even over the frame's time, within half of a pose's.
    let middle = |i: usize| (2 * i + 1) * poses.len() / (2 * count);
    let drawn: Vec<_> = (0..count).map(|i| poses[middle(i)].clone()).collect();
    let mut yuyv = vec![0; renderer.frame_bytes()];
    renderer.render(&drawn, sequence, &mut yuyv);
    yuyv
}

/// Where a moving point, at these places evenly over a frame's time, appears: in the middle
/// of the exposure of the row that shows it.
pub(crate) fn as_seen(camera: &StereoCamera, places_m: &[Vector3<f64>]) -> Vector3<f64> {
    let at = |t_s: f64| {
        let place = t_s / camera.frame_time_s() * places_m.len() as f64 - 0.5;
        let place = place.clamp(0.0, (places_m.len() - 1) as f64);
        let before = (place as usize).min(places_m.len().saturating_sub(2));
        let [a, b] = [before, (before + 1).min(places_m.len() - 1)].map(|i| places_m[i]);
        a + (b - a) * (place - before as f64)
    };
    let mut row = f64::from(camera.height_px) / 2.0;
    // A point moves far less than a row in a row's time.
    for _ in 0..4 {
        let seen = camera.project_left(&at(camera.row_time_s(row)));
        row = seen.map_or(row, |[_, v]| v);
    }
    at(camera.row_time_s(row))
}
