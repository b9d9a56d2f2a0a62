//! What was read off a film: a curve in every frame, and its two ends.

use super::colour::Colour;
use super::curve::{Pixel, across, at_fraction, from_end, length};
use super::end::End;
use super::field::Offset;
use super::statistics::mean;

/// What was read.
#[derive(Debug)]
pub(super) struct Reading {
    /// Curves of all frames, from the hypothesis's clamp to its end.
    pub(super) curves: Vec<Vec<Pixel>>,
    /// How evident the rope is at each of their nodes, 0 to 1.
    pub(super) evident: Vec<Vec<f64>>,
    /// Where the rope begins, from the hypothesis's clamp on (px).
    pub(super) start_px: f64,
    pub(super) end: End,
    /// The tip weight in each frame, along and across the curve from its usual place.
    pub(super) tips: Vec<[Offset; 2]>,
    /// Half the rope's width, and the tip weight's radius (px), which is rough unless all
    /// frames are read.
    pub(super) radii_px: [f64; 2],
    pub(super) rope: Vec<Colour>,
    pub(super) tip: Vec<Colour>,
}

impl Reading {
    /// The tip weight's centre in a frame.
    pub(super) fn tip(&self, frame: usize) -> Pixel {
        let [along, aside] = self.tips[frame];
        let curve = &self.curves[frame];
        let (p, _) = from_end(curve, self.end.centre_px + along.px);
        let (_, t) = from_end(curve, self.end.centre_px);
        p + across(t) * aside.px
    }

    /// `count` places of a frame at equal distances along the rope, from the clamp to the
    /// tip weight's centre, and how evident it is at each. What the weight hides is straight.
    pub(super) fn places(&self, frame: usize, count: usize) -> (Vec<Pixel>, Vec<f64>) {
        let (curve, evident) = (&self.curves[frame], &self.evident[frame]);
        let [along, aside] = self.tips[frame];
        let length = length(curve);
        let first = self.start_px / length;
        let last = 1.0 + (self.end.centre_px + along.px) / length;
        let shown = self.end.nodes_shown(curve) - 1;
        let edge = shown as f64 / (curve.len() - 1) as f64;
        let (edge_place, tip) = (curve[shown], self.tip(frame));
        let place = |k: usize| {
            let at = first + (last - first) * k as f64 / (count - 1) as f64;
            if at <= edge {
                return (at_fraction(curve, at), local_mean(evident, at));
            }
            let w = (at - edge) / (last - edge);
            (edge_place + (tip - edge_place) * w, aside.weight)
        };
        (0..count).map(place).unzip()
    }
}

/// Mean over the nodes around a part of the curve.
fn local_mean(values: &[f64], part: f64) -> f64 {
    let last = values.len() - 1;
    let at = (part.clamp(0.0, 1.0) * last as f64).round() as usize;
    mean(&values[at.saturating_sub(2)..(at + 3).min(values.len())])
}
