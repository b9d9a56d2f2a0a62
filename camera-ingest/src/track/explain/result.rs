//! From what was read off a film to keypoints, what speaks for them, and what else they show.

use rope_sim::AttachMotion;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};

use super::super::confirmation::{Confirmation, UNCONFIRMED};
use super::super::plane::RopePlane;
use super::super::{RopeAppearance, TrackError, TrackResult, TrackTimes, timing};
use super::colour::{CHROMA_WEIGHT, Colour};
use super::curve::{Pixel, length};
use super::read::NODES;
use super::reading::Reading;
use super::statistics::{mean, quantile};
use super::witness::Testimony;
use crate::frame::rgb_from_ycc;

/// Evidence of the rope, in the middle over nodes and frames and in the least evident
/// tenth of either, below which a hypothesis explains too little.
const MIN_EVIDENT: [f64; 3] = [0.35, 0.12, 0.12];
/// A frame with less than this part of the usual evidence is lost.
const LOST: f64 = 0.2;
/// Nothing seen is more certain than this.
const MAX_CONFIDENCE: f64 = 0.98;
/// A clamp that has gone so far moves (m).
const MOVES_M: f64 = 1e-3;
/// Shortest time before that in which a swing shows (s).
const WATCHED_S: f64 = 0.2;
/// Nodes at the clamp that show the pole as much as the rope.
const CLAMP_NODES: usize = 2;

/// How evident the rope is in most frames, if it is evident enough along all of it and in
/// nearly all of them.
pub(super) fn usual_evidence(reading: &Reading, keypoints: usize) -> Result<f64, TrackError> {
    let evident: Vec<Vec<f64>> = (0..reading.curves.len())
        .map(|i| reading.places(i, keypoints).1)
        .collect();
    let frames = evident.iter().map(|f| mean(f));
    let node = |k: usize| mean(&evident.iter().map(|f| f[k]).collect::<Vec<_>>());
    let usual = quantile(frames.clone(), 0.5);
    // The first keypoint is the pole's as much as the rope's.
    let least_nodes = quantile((1..keypoints).map(node), 0.1);
    let found = [usual, least_nodes, quantile(frames, 0.1)];
    tracing::debug!(
        ?found,
        "evidence of the rope: middle, least nodes, least frames"
    );
    if found.iter().zip(MIN_EVIDENT).any(|(f, least)| *f < least) {
        return Err(TrackError::NoRope {
            evident: found,
            least: MIN_EVIDENT,
        });
    }
    Ok(usual)
}

/// Keypoints, looks and the clamp's time and place.
pub(super) fn result(
    reading: &Reading,
    testimony: Option<&Testimony>,
    times_s: &[f64],
    (camera, motion): (&StereoCamera, &dyn AttachMotion),
    keypoints: usize,
) -> Result<TrackResult, TrackError> {
    let usual = usual_evidence(reading, keypoints)?;
    let plane = RopePlane::fit(camera, motion, times_s[times_s.len() - 1])
        .ok_or_else(TrackError::behind_camera)?;
    let mut frames = Vec::with_capacity(times_s.len());
    let mut clamps = Vec::new();
    for (index, t_s) in times_s.iter().enumerate() {
        let (points, evident) = reading.places(index, keypoints);
        let confidence = |(k, e): (usize, &f64)| {
            let part = k as f64 / (keypoints - 1) as f64;
            let confirmed = testimony.map_or(1.0, |t| t.around(index).max(t.along(part)));
            (e / usual).min(1.0) * confirmed.min(MAX_CONFIDENCE)
        };
        let lost = mean(&evident) < LOST * usual;
        if !lost {
            let (nodes, evident) = reading.places(index, NODES);
            let nodes = nodes.into_iter().zip(evident);
            let nodes: Vec<_> = nodes
                .map(|(p, e)| (plane.point_at(p.into()), (e / usual).min(1.0)))
                .collect();
            let clamp = timing::seen_clamp(&nodes, CLAMP_NODES);
            clamps.extend(clamp.map(|clamp| (*t_s, clamp)));
        }
        frames.push(TrackedFrame {
            t_s: *t_s,
            points: points.into_iter().map(Into::into).collect(),
            confidence: evident.iter().enumerate().map(confidence).collect(),
            lost,
        });
    }
    let confirmation = Confirmation {
        tip: quantile(reading.tips.iter().map(|[_, aside]| aside.weight), 0.5),
        second_image: testimony.map(Testimony::confirmed),
        sway: sway(&frames, motion),
    };
    let unconfirmed = confirmation.unconfirmed(&frames);
    if !unconfirmed.is_empty() {
        // Nothing is certain in a track that is unconfirmed as a whole.
        let all = frames.iter_mut().flat_map(|f| &mut f.confidence);
        all.for_each(|c| *c *= UNCONFIRMED);
    }
    let predicted = |t_s: f64| {
        let seen = |t_s: f64| camera.project_left(&motion.at(t_s).p_m);
        let row = seen(t_s).map_or(0.0, |[_, v]| v);
        plane.point_at(seen(t_s + camera.row_time_s(row)).unwrap_or([f64::NAN; 2]))
    };
    let at_rest = reading.places(0, NODES).0.into_iter();
    let at_rest: Vec<Pixel> = at_rest.map(|p| plane.point_at(p.into()).into()).collect();
    let [rope_radius_m, lead_radius_m] = reading.radii_px.map(|px| px / plane.px_per_m);
    Ok(TrackResult {
        track: KeypointTrack {
            keypoints,
            frames,
            unconfirmed,
        },
        appearance: RopeAppearance {
            rope_radius_m,
            lead_radius_m,
            length_m: length(&at_rest),
            rope_rgb: rgb(&reading.rope),
            lead_rgb: rgb(&reading.tip),
        },
        confirmation,
        clamp: timing::fit(&clamps, 1.0 / plane.px_per_m, predicted),
        times: TrackTimes::default(),
    })
}

/// How far the rope swings before the clamp moves: the way of the keypoint that moves
/// furthest, as a part of the rope's length as it is seen.
fn sway(frames: &[TrackedFrame], motion: &dyn AttachMotion) -> Option<f64> {
    let start_m = motion.at(frames.first()?.t_s).p_m;
    let is_before = |f: &&TrackedFrame| (motion.at(f.t_s).p_m - start_m).norm() < MOVES_M;
    let before: Vec<&TrackedFrame> = frames.iter().take_while(is_before).collect();
    if before.last()?.t_s - before[0].t_s < WATCHED_S {
        return None;
    }
    let along = |f: &TrackedFrame| -> f64 {
        let pairs = f.points.windows(2);
        pairs
            .map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1]))
            .sum()
    };
    let way = |k: usize, axis: usize| {
        let at = before.iter().filter(|f| !f.lost).map(|f| f.points[k][axis]);
        at.clone().fold(f64::MIN, f64::max) - at.fold(f64::MAX, f64::min)
    };
    let ways = (0..before[0].points.len()).map(|k| way(k, 0).hypot(way(k, 1)));
    Some(ways.fold(0.0, f64::max) / along(before[0]))
}

/// The first of some colours.
fn rgb(colours: &[Colour]) -> [u8; 3] {
    let [y, cb, cr] = colours.first().copied().unwrap_or_default();
    rgb_from_ycc([y, 128.0 + cb / CHROMA_WEIGHT, 128.0 + cr / CHROMA_WEIGHT])
}
