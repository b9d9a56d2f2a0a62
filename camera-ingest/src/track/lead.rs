//! Which place on the moving mask is the lead.
//!
//! No single sign does: a lead may be hardly fatter than its rope, or have its
//! colour; a shadow may hang on behind it. So every ridge of the mask is a
//! hypothesis, and three signs are added up: how much fatter than the rope it
//! is, how unlike the rope (and unlike a shadow) it looks, and how much of the
//! rope lies between it and the clamp. With neither width nor colour to go by,
//! the last one still ends the rope at its free end.

use super::background::Background;
use super::evidence::Colour;
use super::first_frame::{colour_at, colour_of};
use super::geodesic::{Depth, Geodesic};
use crate::frame::EyeFrame;

/// What is rope whatever follows: this part of the way from the clamp (m).
const SURELY_ROPE_M: [f64; 2] = [0.03, 0.25];
/// The lead hangs at least this far from the clamp (m).
pub(super) const LEAST_ROPE_M: f64 = 0.12;
/// Colour distance that is as good as certain (grey levels).
const CLEAR_COLOUR: f32 = 50.0;
/// Colour distance that says nothing: noise and compression (grey levels).
const UNCLEAR_COLOUR: f32 = 10.0;
/// Colours nearer than this to the rope's are the rope's (grey levels), plus
/// twice the rope's own scatter.
const ROPE_COLOUR: f32 = 25.0;
/// A hypothesis this much better than another one is clearly better.
const CLEAR_SCORE: f64 = 0.7;
/// Hypotheses nearer than this to each other are the same lead (part of the
/// longest way).
const APART: f64 = 0.15;
/// Noise moves the mask's edge by this (px).
const RAGGED_PX: f32 = 0.7;
/// Brightness a shadow leaves.
const SHADOW: [f32; 2] = [0.3, 1.0];

/// The frame, its mask and the ways over it.
pub(super) struct Search<'a> {
    pub(super) frame: &'a EyeFrame,
    pub(super) background: &'a Background,
    pub(super) gain: f32,
    pub(super) mask: &'a [bool],
    /// Distance to the mask's edge.
    pub(super) depth: &'a Depth,
    pub(super) ways: &'a Geodesic,
    pub(super) px_per_m: f64,
    /// Least and greatest length of the way to the lead (m).
    pub(super) length_m: [f64; 2],
}

/// What the rope near the clamp looks like.
struct Rope {
    colour: Colour,
    scatter: f32,
    depth_px: f32,
}

/// The best hypothesis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Best {
    /// Index of the pixel.
    pub(super) at: usize,
    /// No other place, well apart from it, is nearly as good.
    pub(super) sole: bool,
}

/// Why there is no lead: the longest way found (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TooShort(pub(super) f64);

impl Search<'_> {
    /// The pixel that is most likely the lead's centre.
    pub(super) fn best(&self) -> Result<Best, TooShort> {
        let reached: Vec<(usize, f64)> = (0..self.mask.len())
            .filter(|&at| self.mask[at])
            .filter_map(|at| Some((at, self.ways.length_px(at)? / self.px_per_m)))
            .collect();
        let longest_m = reached.iter().map(|r| r.1).fold(0.0, f64::max);
        let ridges: Vec<(usize, f64)> = reached
            .iter()
            .copied()
            .filter(|&(at, _)| self.is_ridge(at))
            .collect();
        let rope = self.rope(&ridges).ok_or(TooShort(longest_m))?;
        let rope_lengths = self.rope_lengths(&reached, &rope);
        let score = |at: usize, length_m: f64| {
            self.fatter(at, &rope) + self.unlike(at, &rope) + share_within(&rope_lengths, length_m)
        };
        let scored: Vec<(usize, f64)> = ridges
            .iter()
            .filter(|r| (self.length_m[0]..=self.length_m[1]).contains(&r.1))
            .map(|&(at, length_m)| (at, score(at, length_m)))
            .collect();
        let &(at, most) = scored
            .iter()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .ok_or(TooShort(longest_m))?;
        let apart_px = APART * longest_m * self.px_per_m;
        let rival = |&&(other, score): &&(usize, f64)| {
            score > most - CLEAR_SCORE && self.distance_px(at, other) > apart_px
        };
        Ok(Best {
            at,
            sole: scored.iter().find(rival).is_none(),
        })
    }

    fn distance_px(&self, a: usize, b: usize) -> f64 {
        let width = self.frame.width_px;
        let along = |x: usize, y: usize| x.abs_diff(y) as f64;
        along(a % width, b % width).hypot(along(a / width, b / width))
    }

    /// No neighbour lies deeper inside the mask.
    fn is_ridge(&self, at: usize) -> bool {
        let width = self.frame.width_px;
        // The mask keeps off the image's border.
        [at - width, at, at + width]
            .into_iter()
            .flat_map(|row| row - 1..=row + 1)
            .all(|near| self.depth.px(near) <= self.depth.px(at))
    }

    /// Colour and half-width of the rope, from its first part.
    fn rope(&self, ridges: &[(usize, f64)]) -> Option<Rope> {
        let near = |&&(_, length_m): &&(usize, f64)| {
            (SURELY_ROPE_M[0]..=SURELY_ROPE_M[1]).contains(&length_m)
        };
        let first: Vec<usize> = ridges.iter().filter(near).map(|r| r.0).collect();
        let mut depths: Vec<f32> = first.iter().map(|&at| self.depth.px(at)).collect();
        depths.sort_by(f32::total_cmp);
        let depth_px = *depths.get(depths.len() / 2)?;
        let (colour, scatter) = self.colour(first.into_iter());
        Some(Rope {
            colour,
            scatter,
            depth_px,
        })
    }

    /// First sign: doublings of the rope's width, less what may be ragged.
    fn fatter(&self, at: usize, rope: &Rope) -> f64 {
        let sure_px = (self.depth.px(at) - RAGGED_PX).max(rope.depth_px);
        f64::from(sure_px / rope.depth_px).log2()
    }

    /// Second sign: 1 where the colour is clearly neither the rope's nor that
    /// of a shadow on the background, 0 where it is one of them.
    fn unlike(&self, at: usize, rope: &Rope) -> f64 {
        let width = self.frame.width_px;
        let reach = (self.depth.px(at) / 2.0 - 0.5).max(0.0);
        let (u, v) = (at % width, at / width);
        let near = |x: usize| x.saturating_sub(reach as usize)..=x + reach as usize;
        let inside = near(v).flat_map(|y| near(u).map(move |x| y * width + x));
        let inside = inside.filter(|&i| self.mask.get(i) == Some(&true));
        let colour = self.colour(inside).0;
        let away = distance(colour, rope.colour) - 2.0 * rope.scatter;
        let away = away.min(self.unlike_shadow(at, colour)) - UNCLEAR_COLOUR;
        f64::from((away / CLEAR_COLOUR).clamp(0.0, 1.0))
    }

    /// Distance of a colour from the darkened background at a pixel.
    fn unlike_shadow(&self, at: usize, colour: Colour) -> f32 {
        let width = self.frame.width_px;
        let empty = self.background.image.ycc(at % width, at / width);
        let empty = empty.map(f32::from);
        let shade = (colour[0] / empty[0].max(1.0)).clamp(SHADOW[0], SHADOW[1]);
        let dark = |k: usize| 128.0 + (empty[k] - 128.0) * shade;
        distance(colour, [empty[0] * shade, dark(1), dark(2)])
    }

    /// Lengths of the ways to all rope-coloured pixels (m), sorted.
    fn rope_lengths(&self, reached: &[(usize, f64)], rope: &Rope) -> Vec<f64> {
        let limit = ROPE_COLOUR + 2.0 * rope.scatter;
        let mut lengths: Vec<f64> = reached
            .iter()
            .filter(|r| {
                let (u, v) = (r.0 % self.frame.width_px, r.0 / self.frame.width_px);
                distance(colour_at(self.frame, self.gain, u, v), rope.colour) < limit
            })
            .map(|r| r.1)
            .collect();
        lengths.sort_by(f64::total_cmp);
        lengths
    }

    fn colour(&self, pixels: impl Iterator<Item = usize>) -> (Colour, f32) {
        let width = self.frame.width_px;
        colour_of(
            self.frame,
            self.gain,
            pixels.map(|i| [i % width, i / width]),
        )
    }
}

/// Third sign: part of the rope that lies no further from the clamp than this.
fn share_within(sorted_lengths_m: &[f64], length_m: f64) -> f64 {
    let within = sorted_lengths_m.partition_point(|l| *l <= length_m);
    within as f64 / sorted_lengths_m.len().max(1) as f64
}

/// A lead with the rope's colour and about its width: no centroid can tell it
/// from the rope, only the outline of its free end can.
pub(super) fn blends_in(lead: Colour, (rope, scatter): (Colour, f32), widths: f64) -> bool {
    /// Widths of the rope that make a lead stand out whatever its colour.
    const STANDS_OUT: f64 = 1.4;
    distance(lead, rope) < ROPE_COLOUR + 2.0 * scatter && widths < STANDS_OUT
}

fn distance(a: Colour, b: Colour) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f32>().sqrt()
}
