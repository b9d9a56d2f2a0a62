//! What was read off a film: a curve in every frame, and its two ends.

use super::colour::Colour;
use super::curve::{at_part, from_end, length_px};
use super::end::End;
use super::field::Offset;

/// What was read.
#[derive(Debug)]
pub(super) struct Reading {
    /// Curves of all frames, from the hypothesis's clamp to its end.
    pub(super) curves: Vec<Vec<[f64; 2]>>,
    /// How evident the rope is at each of their nodes, 0 to 1.
    pub(super) evident: Vec<Vec<f64>>,
    /// Where the rope begins, from the hypothesis's clamp on (px).
    pub(super) start_px: f64,
    pub(super) end: End,
    /// The tip weight in each frame, along and across the curve from its usual place.
    pub(super) tips: Vec<(Offset, Offset)>,
    /// Half the rope's width, and the tip weight's radius (px).
    pub(super) radii_px: [f64; 2],
    pub(super) rope: Vec<Colour>,
    pub(super) tip: Vec<Colour>,
}

impl Reading {
    /// Number of frames.
    pub(super) fn frames(&self) -> usize {
        self.curves.len()
    }

    /// The tip weight's centre in a frame (px).
    pub(super) fn tip_px(&self, frame: usize) -> [f64; 2] {
        let (along, across) = self.tips[frame];
        let curve = &self.curves[frame];
        let (p, _) = from_end(curve, self.end.centre_px + along.px);
        let (_, t) = from_end(curve, self.end.centre_px);
        [p[0] - t[1] * across.px, p[1] + t[0] * across.px]
    }

    /// `count` places of a frame at equal distances along the rope, from the clamp to the
    /// tip weight's centre, and how evident it is at each. What the weight hides is straight.
    pub(super) fn places(&self, frame: usize, count: usize) -> (Vec<[f64; 2]>, Vec<f64>) {
        let (curve, evident) = (&self.curves[frame], &self.evident[frame]);
        let (along, across) = self.tips[frame];
        let length = length_px(curve);
        let first = self.start_px / length;
        let last = 1.0 + (self.end.centre_px + along.px) / length;
        let shown = self.end.nodes_shown(curve) - 1;
        let edge = shown as f64 / (curve.len() - 1) as f64;
        let (edge_px, tip_px) = (curve[shown], self.tip_px(frame));
        let place = |k: usize| {
            let at = first + (last - first) * k as f64 / (count - 1) as f64;
            if at <= edge {
                return (at_part(curve, at), local_mean(evident, at));
            }
            let w = (at - edge) / (last - edge);
            let [u, v] = [0, 1].map(|i| edge_px[i] + (tip_px[i] - edge_px[i]) * w);
            ([u, v], across.weight)
        };
        (0..count).map(place).unzip()
    }
}

/// Mean over the nodes around a part of the curve.
fn local_mean(values: &[f64], part: f64) -> f64 {
    let last = values.len() - 1;
    let at = (part.clamp(0.0, 1.0) * last as f64).round() as usize;
    let near = &values[at.saturating_sub(2)..(at + 3).min(values.len())];
    near.iter().sum::<f64>() / near.len() as f64
}
