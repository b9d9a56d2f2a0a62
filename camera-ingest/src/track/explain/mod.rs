//! Finding the rope by explaining the film.
//!
//! One hypothesis about the rope, simulated under the arm's own motion and projected
//! through the camera, is compared with the whole film at once. What it explains can be no
//! shadow, cable or piece of furniture: they do not hang on the clamp and swing as a rope
//! does. The film is read off along it: a few pixels across the hypothesis, frame by
//! frame, and its two ends where the median picture along the rope has them; to that the
//! hypothesis is fitted, and the film read off again.

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
mod result;
mod round;
mod search;
mod statistics;
mod witness;

use std::time::Instant;

use rope_sim::AttachMotion;
use shared_types::StereoCamera;

use super::scene::{SCENE_FRAMES, Scene};
use super::{TrackError, TrackResult, TrackTimes};
use crate::frame::ImageFrame;
use explainer::Explainer;
use hypothesis::Fidelity;
pub(crate) use live::Known;
pub(super) use statistics::median;
use witness::Testimony;

/// Frames of which both images are looked at.
const BOTH: usize = 100;

/// A film of one eye, or of both.
#[derive(Debug, Clone, Copy)]
pub struct Film<'a> {
    /// Left image, all frames.
    pub left: &'a [ImageFrame],
    /// Right image: frames with the stamps of left ones, those of which
    /// [`Film::needs_right`] is true; none for a film of one eye.
    pub right: &'a [ImageFrame],
}

impl<'a> Film<'a> {
    /// Whether of the frame at an index, of so many, the right image helps.
    #[must_use]
    pub fn needs_right(index: usize, frames: usize) -> bool {
        index.is_multiple_of((frames / BOTH).max(1))
    }

    /// The right image of an instant, where there is one.
    fn right_at(&self, stamp_ns: u64) -> Option<&'a ImageFrame> {
        let at = self.right.binary_search_by_key(&stamp_ns, |f| f.stamp_ns);
        at.ok().map(|at| &self.right[at])
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
    keypoints: usize,
) -> Result<TrackResult, TrackError> {
    let start = Instant::now();
    let since_s = |f: &ImageFrame| (f.stamp_ns - film.left[0].stamp_ns) as f64 * 1e-9;
    let times_s: Vec<f64> = film.left.iter().map(since_s).collect();
    let left = Scene::of(film.left);
    let right = (film.right.len() >= SCENE_FRAMES).then(|| Scene::of(film.right));
    let scenes = (&left, right.as_ref());
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let explainer = Explainer::new(film, &times_s, scenes, (camera, motion), threads);
    let background = start.elapsed();

    let start = Instant::now();
    let x = explainer.hypothesis()?;
    let searching = start.elapsed();

    let start = Instant::now();
    let found = explainer.read(&x, Fidelity::FINAL, 1)?;
    let testimony = right.and_then(|scene| Testimony::of(film, &scene, &times_s, &found));
    let testimony = testimony.as_ref();
    let mut result = result::result(
        &found.reading,
        testimony,
        &times_s,
        (camera, motion),
        keypoints,
    )?;
    result.times = TrackTimes {
        background,
        searching,
        reading: start.elapsed(),
    };
    Ok(result)
}
