//! The second image as a witness.
//!
//! What was read off one image lies at the hypothesis's depth: that says where it is in the
//! other one. A shadow on the wall, a cable further back or a person is elsewhere there.

use super::super::scene::Scene;
use super::Film;
use super::colour::{Colour, SHADES, shaded};
use super::curve::Pixel;
use super::evidence::Lit;
use super::explainer::Explained;
use super::field::{Offset, ProfileSearch, offsets};
use super::hypothesis::Side;
use super::read::NODES;
use super::statistics::{mean, median};
use crate::frame::ImageFrame;

/// The rope is looked for this far to either side of where it should be (px).
const REACH_PX: usize = 8;
/// Found so near, once what all places have in common is taken off, it is confirmed (px).
const NEAR_PX: f64 = 3.0;
/// What all may have in common: the right image's calibration (px).
const COMMON_PX: f64 = 4.0;
/// Least contrast of what is found.
const MIN_WEIGHT: f64 = 0.3;

/// One frame of the second image.
struct View<'a> {
    /// Index of the first image's frame of the same time.
    index: usize,
    frame: &'a ImageFrame,
    /// Where the rope should be.
    curve: Vec<Pixel>,
}

/// What the second image shows.
#[derive(Debug, Clone)]
pub(super) struct Testimony {
    /// Frames looked at, and the part of the rope that each confirms.
    frames: Vec<(usize, f64)>,
    /// Part of the frames that confirm a place.
    nodes: Vec<f64>,
}

impl Testimony {
    /// Looks in the right images where they should show what was read off the left ones: as
    /// far from the hypothesis as there. `scene` is the right images'.
    pub(super) fn of(
        film: Film<'_>,
        scene: &Scene,
        times_s: &[f64],
        found: &Explained,
    ) -> Option<Self> {
        let view = |frame| {
            let stamp_ns = |f: &ImageFrame| f.stamp_ns;
            let index = film.left.binary_search_by_key(&stamp_ns(frame), stamp_ns);
            let index = index.ok()?;
            let mut curve = found.seen.curve(times_s[index], Side::Right, NODES)?;
            let left = found.curves[index].iter().zip(&found.reading.curves[index]);
            for (p, (predicted, read)) in curve.iter_mut().zip(left) {
                *p = *p + read - predicted;
            }
            Some(View {
                index,
                frame,
                curve,
            })
        };
        let views: Vec<View<'_>> = film.right.iter().filter_map(view).collect();
        let rope = &found.reading.rope;
        Self::from_views(scene, &views, rope, found.reading.end.rope_half_px)
    }

    /// Looks for the rope's colours where it should be.
    fn from_views(
        scene: &Scene,
        views: &[View<'_>],
        rope: &[Colour],
        half_width_px: f64,
    ) -> Option<Self> {
        if views.is_empty() {
            return None;
        }
        let look = ProfileSearch {
            reach: REACH_PX,
            half_width_px,
            jump: 0.05,
        };
        let rope = shaded(rope, &SHADES);
        let offsets = |view: &View<'_>| {
            let lit = Lit::of(view.frame, scene);
            offsets(&view.curve, look, |p| lit.present(&rope, p))
        };
        let found: Vec<Vec<Offset>> = views.iter().map(offsets).collect();
        let clear = found.iter().flatten().filter(|o| o.weight > MIN_WEIGHT);
        let common_px = median(clear.map(|o| o.px));
        let confirms = |o: &Offset| {
            let is_near = (o.px - common_px).abs() <= NEAR_PX;
            f64::from(o.weight > MIN_WEIGHT && is_near && common_px.abs() <= COMMON_PX)
        };
        let confirmed: Vec<Vec<f64>> = found
            .iter()
            .map(|offsets| offsets.iter().map(confirms).collect())
            .collect();
        let node = |k: usize| mean(&confirmed.iter().map(|c| c[k]).collect::<Vec<_>>());
        let frames = views.iter().zip(&confirmed);
        Some(Self {
            frames: frames.map(|(s, c)| (s.index, mean(c))).collect(),
            nodes: (0..NODES).map(node).collect(),
        })
    }

    /// Part of all places in all frames that is confirmed.
    pub(super) fn confirmed(&self) -> f64 {
        Self::mean_fraction(&self.frames)
    }

    fn mean_fraction(frames: &[(usize, f64)]) -> f64 {
        mean(&frames.iter().map(|(_, part)| *part).collect::<Vec<_>>())
    }

    /// Part of the rope confirmed in the frame nearest to one of the first image's.
    pub(super) fn around(&self, index: usize) -> f64 {
        let after = self.frames.partition_point(|(i, _)| *i < index);
        let near = after.saturating_sub(1)..(after + 1).min(self.frames.len());
        Self::mean_fraction(&self.frames[near])
    }

    /// Part of the frames that confirm a part of the rope (0 at the clamp to 1).
    pub(super) fn along(&self, part: f64) -> f64 {
        let last = self.nodes.len() - 1;
        self.nodes[(part.clamp(0.0, 1.0) * last as f64).round() as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(stamp_ns: u64, rope_at: Option<usize>) -> ImageFrame {
        let mut frame = ImageFrame {
            stamp_ns,
            ..ImageFrame::grey([96, 128], 150)
        };
        if let Some(u) = rope_at {
            for v in 0..128 {
                frame.luma[v * 96 + u - 3..v * 96 + u + 3].fill(40);
            }
        }
        frame
    }

    #[test]
    fn a_rope_at_another_depth_is_not_confirmed() {
        let scene = Scene::of(&[drawn(1, None), drawn(2, None), drawn(3, None)]);
        let confirmed = |rope_at: usize, frames: u64| {
            let frames: Vec<ImageFrame> = (0..frames).map(|i| drawn(i, Some(rope_at))).collect();
            let place = |k| Pixel::new(47.5, 10.0 + k as f64 * 1.5);
            let view = |(index, frame)| View {
                index,
                frame,
                curve: (0..NODES).map(place).collect(),
            };
            let views: Vec<View<'_>> = frames.iter().enumerate().map(view).collect();
            Testimony::from_views(&scene, &views, &[[40.0, 0.0, 0.0]], 3.0).map(|t| t.confirmed())
        };
        assert!(confirmed(48, 4).unwrap() > 0.95);
        assert!(
            confirmed(50, 4).unwrap() > 0.95,
            "a calibration a little off"
        );
        assert!(confirmed(54, 4).unwrap() < 0.05);
        assert!(confirmed(70, 4).unwrap() < 0.05);
        assert!(confirmed(48, 0).is_none());
    }
}
