//! Finding the rope by explaining the film.
//!
//! One hypothesis about the rope, simulated under the arm's own motion and projected
//! through the camera, is compared with the whole film at once. What it explains can be no
//! shadow, cable or piece of furniture: they do not hang on the clamp and swing as a rope
//! does. The film is read off along it: a few pixels across the hypothesis, frame by
//! frame, and its two ends where the median picture along the rope has them; to that the
//! hypothesis is fitted, and the film read off again.

mod bulk;
mod colour;
mod curve;
mod disc;
mod end;
mod ends;
mod evidence;
mod explainer;
mod field;
mod hypothesis;
mod live;
mod read;
mod reading;
mod refine;
mod round;
mod search;
mod witness;

use std::time::Instant;

use rope_sim::AttachMotion;
use shared_types::keypoints::TrackedFrame;
use shared_types::{KeypointTrack, StereoCamera};

use super::confirmation::{Confirmation, DOUBT, doubted};
use super::plane::RopePlane;
use super::timing::{self, SeenNode};
use super::{RopeAppearance, TrackError, TrackOptions, TrackResult, TrackTimes};
use crate::frame::{EyeFrame, rgb_from_ycc};
use colour::{CHROMA_WEIGHT, Colour};
use evidence::Scene;
use explainer::{Explainer, curve_at};
use hypothesis::{Fidelity, Seen, Side, simulate};
pub(crate) use live::Known;
use read::{Lit, NODES};
use reading::Reading;
use search::{Moment, SearchError};
use witness::{Sight, Testimony};

/// Frames that are searched.
const SEARCHED: usize = 100;
/// Evidence of the rope, in the middle over nodes and frames and in the least evident
/// tenth of either, below which a hypothesis explains too little.
const LEAST_EVIDENT: [f64; 3] = [0.35, 0.12, 0.12];
/// A frame with less than this part of the usual evidence is lost.
const LOST: f64 = 0.2;
/// Nothing seen is more certain than this.
const MOST_CONFIDENT: f64 = 0.98;
/// Nodes at the clamp that show the pole as much as the rope.
const CLAMP_NODES: usize = 2;

/// A film of one eye, or of both.
#[derive(Debug, Clone, Copy)]
pub struct Film<'a> {
    /// Left image, all frames.
    pub left: &'a [EyeFrame],
    /// Right image: frames with the stamps of left ones, those of which
    /// [`Film::needs_right`] is true; none for a film of one eye.
    pub right: &'a [EyeFrame],
}

impl Film<'_> {
    /// Whether of the frame at an index, of so many, the right image helps.
    #[must_use]
    pub fn needs_right(index: usize, frames: usize) -> bool {
        index.is_multiple_of((frames / SEARCHED).max(1))
    }
}

impl From<SearchError> for TrackError {
    fn from(error: SearchError) -> Self {
        Self::Motion {
            reason: error.to_string(),
        }
    }
}

/// Tracks the rope through a film by explaining it.
///
/// `motion` is the attach frame's, t = 0 at the first frame. Keypoints are raw left pixels at
/// equal distances along the rope.
pub(super) fn explain(
    film: Film<'_>,
    camera: &StereoCamera,
    motion: &dyn AttachMotion,
    options: &TrackOptions,
) -> Result<TrackResult, TrackError> {
    let start = Instant::now();
    let times_s: Vec<f64> = film
        .left
        .iter()
        .map(|f| (f.stamp_ns - film.left[0].stamp_ns) as f64 * 1e-9)
        .collect();
    let scene = Scene::of(film.left, options.background_frames);
    // A median of fewer shows the rope.
    let right = (film.right.len() >= options.background_frames)
        .then(|| Scene::of(film.right, options.background_frames));
    let lit: Vec<Lit<'_>> = film.left.iter().map(|f| Lit::of(f, &scene)).collect();
    let moments = moments(film, &lit, (&scene, right.as_ref()), &times_s);
    let background = start.elapsed();

    let start = Instant::now();
    let explainer = Explainer {
        scene: &scene,
        frames: &lit,
        times_s: &times_s,
        camera,
        motion,
        threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    let x = explainer.hypothesis(&moments)?;
    drop(moments);
    let searching = start.elapsed();

    let start = Instant::now();
    let curves = explainer.told(&x, Fidelity::FINAL, 1)?;
    let reading = explainer.read(curves.clone(), 1);
    let testimony = match right {
        Some(right) => {
            let film_s = explainer.film_s();
            let rollouts =
                simulate(&[x], Fidelity::FINAL, motion, film_s, 1).map_err(SearchError::from)?;
            let seen = Seen::new(&x, &rollouts[0], camera).ok_or(TrackError::BehindCamera)?;
            let sights = sights(film, &seen, &times_s, &curves, &reading.curves);
            Testimony::of(&right, &sights, &reading.rope, reading.end.rope_half_px)
        }
        None => None,
    };
    let usual = usual_evidence(&reading, options.keypoints)?;
    let read = Read {
        reading: &reading,
        usual,
        testimony: testimony.as_ref(),
        times_s: &times_s,
    };
    let mut result =
        result(&read, (camera, motion), options.keypoints).ok_or(TrackError::BehindCamera)?;
    result.appearance.noise = scene.noise();
    result.times = TrackTimes {
        background,
        searching,
        reading: start.elapsed(),
    };
    Ok(result)
}

/// Where the right images should show what was read off the left ones: as far from the
/// hypothesis as there.
fn sights<'a>(
    film: Film<'a>,
    seen: &Seen<'_>,
    times_s: &[f64],
    before: &[Vec<[f64; 2]>],
    read: &[Vec<[f64; 2]>],
) -> Vec<Sight<'a>> {
    let sight = |frame: &'a EyeFrame| {
        let index = film
            .left
            .binary_search_by_key(&frame.stamp_ns, |f| f.stamp_ns)
            .ok()?;
        let mut curve = curve_at(seen, times_s[index], Side::Right)?;
        let moved = before[index].iter().zip(&read[index]);
        for (p, (a, b)) in curve.iter_mut().zip(moved) {
            *p = [p[0] + b[0] - a[0], p[1] + b[1] - a[1]];
        }
        Some(Sight {
            index,
            frame,
            curve,
        })
    };
    film.right.iter().filter_map(sight).collect()
}

/// Evidence of frames spread over the film.
fn moments(
    film: Film<'_>,
    lit: &[Lit<'_>],
    (left, right): (&Scene, Option<&Scene>),
    times_s: &[f64],
) -> Vec<Moment> {
    let searched = (0..times_s.len()).filter(|i| Film::needs_right(*i, times_s.len()));
    let moment = |i: usize| {
        let mut maps = vec![(Side::Left, left.map(&lit[i]))];
        let stamp_ns = film.left[i].stamp_ns;
        let at = film.right.binary_search_by_key(&stamp_ns, |f| f.stamp_ns);
        if let (Some(scene), Ok(at)) = (right, at) {
            maps.push((Side::Right, scene.map(&Lit::of(&film.right[at], scene))));
        }
        Moment {
            t_s: times_s[i],
            maps,
        }
    };
    searched.map(moment).collect()
}

fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let at = (values.len().saturating_sub(1)) as f64 * q;
    values.get(at as usize).copied().unwrap_or(0.0)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// How evident the rope is in most frames, if it is evident enough along all of it and in
/// nearly all of them.
fn usual_evidence(reading: &Reading, keypoints: usize) -> Result<f64, TrackError> {
    let evident: Vec<Vec<f64>> = (0..reading.frames())
        .map(|i| reading.places(i, keypoints).1)
        .collect();
    let frames: Vec<f64> = evident.iter().map(|f| mean(f)).collect();
    let node = |k: usize| mean(&evident.iter().map(|f| f[k]).collect::<Vec<_>>());
    // The first keypoint is the pole's as much as the rope's.
    let nodes: Vec<f64> = (1..keypoints).map(node).collect();
    let usual = quantile(frames.clone(), 0.5);
    let found = [usual, quantile(nodes, 0.1), quantile(frames, 0.1)];
    tracing::debug!(
        ?found,
        "evidence of the rope: middle, least nodes, least frames"
    );
    if found.iter().zip(LEAST_EVIDENT).any(|(f, least)| *f < least) {
        return Err(TrackError::NoRope {
            evident: found,
            least: LEAST_EVIDENT,
        });
    }
    Ok(usual)
}

/// What was read off a film, and what speaks for it.
struct Read<'a> {
    reading: &'a Reading,
    /// How evident the rope is in most frames.
    usual: f64,
    testimony: Option<&'a Testimony>,
    times_s: &'a [f64],
}

impl Read<'_> {
    /// Keypoints of a frame, and how evident the rope is at each.
    fn frame(&self, index: usize, keypoints: usize) -> (TrackedFrame, Vec<f64>) {
        let (points, evident) = self.reading.places(index, keypoints);
        let confirmed = self.testimony.map_or(1.0, |t| t.around(index));
        let confidence = |(k, e): (usize, &f64)| {
            let part = k as f64 / (keypoints - 1) as f64;
            let along = self.testimony.map_or(1.0, |t| t.along(part));
            (e / self.usual).min(1.0) * confirmed.max(along).min(MOST_CONFIDENT)
        };
        let frame = TrackedFrame {
            t_s: self.times_s[index],
            points,
            confidence: evident.iter().enumerate().map(confidence).collect(),
            lost: mean(&evident) < LOST * self.usual,
        };
        (frame, evident)
    }

    fn confirmation(&self, frames: &[TrackedFrame]) -> Confirmation {
        let tips = self.reading.tips.iter().map(|(_, across)| across.weight);
        Confirmation {
            doubted: doubted(frames),
            tip: quantile(tips.collect(), 0.5),
            second_image: self.testimony.map(Testimony::confirmed),
        }
    }
}

/// Keypoints, looks and the clamp's time and place from what was read.
fn result(
    read: &Read<'_>,
    (camera, motion): (&StereoCamera, &dyn AttachMotion),
    keypoints: usize,
) -> Option<TrackResult> {
    let Read {
        reading, times_s, ..
    } = *read;
    let plane = RopePlane::fit(camera, motion, times_s[times_s.len() - 1])?;
    let mut frames = Vec::with_capacity(times_s.len());
    let mut clamps = Vec::new();
    let mut residual = Vec::with_capacity(times_s.len());
    for (i, t_s) in times_s.iter().enumerate() {
        let (frame, evident) = read.frame(i, keypoints);
        let (nodes, seen) = reading.places(i, NODES);
        let across: Vec<SeenNode> = nodes
            .iter()
            .zip(&seen)
            .map(|(p, e)| SeenNode {
                point: plane.point_at(*p),
                confidence: (e / read.usual).min(1.0),
            })
            .collect();
        if !frame.lost
            && let Some(clamp) = timing::seen_clamp(&across, CLAMP_NODES)
        {
            clamps.push((*t_s, clamp));
        }
        residual.push(1.0 - mean(&evident));
        frames.push(frame);
    }
    let confirmation = read.confirmation(&frames);
    let doubts = confirmation.doubts();
    if !doubts.is_empty() {
        // Nothing is certain in a track that is in doubt as a whole.
        let all = frames.iter_mut().flat_map(|f| &mut f.confidence);
        all.for_each(|c| *c *= DOUBT);
    }
    let told = |t_s: f64| {
        let seen = |t_s: f64| camera.project_left(&motion.at(t_s).p_m);
        let row = seen(t_s).map_or(0.0, |[_, v]| v);
        plane.point_at(seen(t_s + camera.row_time_s(row)).unwrap_or([f64::NAN; 2]))
    };
    let at_rest = reading.places(0, NODES).0;
    let at_rest: Vec<_> = at_rest.iter().map(|p| plane.point_at(*p)).collect();
    let [rope_radius_m, lead_radius_m] = reading.radii_px.map(|px| px / plane.px_per_m);
    Some(TrackResult {
        track: KeypointTrack {
            keypoints,
            frames,
            doubts,
        },
        appearance: RopeAppearance {
            rope_radius_m,
            lead_radius_m,
            length_m: curve::length_px(&at_rest),
            rope_rgb: rgb(&reading.rope),
            lead_rgb: rgb(&reading.tip),
            noise: 0.0,
        },
        residual,
        confirmation,
        clamp: timing::fit(&clamps, 1.0 / plane.px_per_m, told),
        times: TrackTimes::default(),
    })
}

/// The first of some colours.
fn rgb(colours: &[Colour]) -> [u8; 3] {
    let [y, cb, cr] = colours.first().copied().unwrap_or_default();
    rgb_from_ycc([y, 128.0 + cb / CHROMA_WEIGHT, 128.0 + cr / CHROMA_WEIGHT])
}
