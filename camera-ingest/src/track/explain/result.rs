//! From what was read off a film to keypoints, what speaks for them, and what else they show.

use rope_sim::AttachMotion;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};

use super::super::confirmation::{Confirmation, UNCONFIRMED};
use super::super::plane::RopePlane;
use super::super::sway::Before;
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
    let at_rest = reading.places(0, NODES).0.into_iter();
    let at_rest: Vec<Pixel> = at_rest.map(|p| plane.point_at(p.into()).into()).collect();
    let length_m = length(&at_rest);
    let confirmation = Confirmation {
        tip: quantile(reading.tips.iter().map(|[_, aside]| aside.weight), 0.5),
        second_image: testimony.map(Testimony::confirmed),
        before: before_motion(&frames, motion, length_m),
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
            length_m,
            rope_rgb: rgb(&reading.rope),
            lead_rgb: rgb(&reading.tip),
        },
        confirmation,
        clamp: timing::fit(&clamps, 1.0 / plane.px_per_m, predicted),
        times: TrackTimes::default(),
    })
}

/// The time before the clamp moves.
fn before_motion(frames: &[TrackedFrame], motion: &dyn AttachMotion, length_m: f64) -> Before {
    let at_m = |t_s: f64| motion.at(t_s).p_m;
    let start_m = at_m(frames.first().map_or(0.0, |f| f.t_s));
    let moves = |f: &&TrackedFrame| (at_m(f.t_s) - start_m).norm() > MOVES_M;
    let first = frames.iter().find(moves).or(frames.last());
    Before {
        until_s: first.map_or(0.0, |f| f.t_s),
        length_m,
    }
}

/// The first of some colours.
fn rgb(colours: &[Colour]) -> [u8; 3] {
    let [y, cb, cr] = colours.first().copied().unwrap_or_default();
    rgb_from_ycc([y, 128.0 + cb / CHROMA_WEIGHT, 128.0 + cr / CHROMA_WEIGHT])
}
