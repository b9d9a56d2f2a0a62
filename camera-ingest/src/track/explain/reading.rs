//! What was read off a film: a curve in every frame, and its two ends.

use super::colour::Colour;
use super::curve::{Pixel, across, at_fraction, distance_px, from_end, length};
use super::end::End;
use super::field::Offset;
use super::statistics::mean;

/// Visible nodes whose mean spacing is used behind the tip weight.
const SPACED_LIKE: usize = 12;

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
        let [_, aside] = self.tips[frame];
        let first = self.start_px / length(curve);
        let shown = self.end.nodes_shown(curve).max(2) - 1;
        let fraction = |node: usize| node as f64 / (curve.len() - 1) as f64;
        let edge = fraction(shown);
        let (edge_place, tip) = (curve[shown], self.tip(frame));
        // The hidden part of the curve is a guess: the centre's place along the rope follows
        // from the straight distance to it, at the spacing of the last visible nodes.
        let near = shown.saturating_sub(SPACED_LIKE);
        let px = length(&curve[near..=shown]).max(1e-9);
        let last = edge + distance_px(edge_place, tip) * (edge - fraction(near)) / px;
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Keypoints lie evenly to the tip weight's centre even where the curve, behind the weight,
    /// goes astray.
    #[test]
    fn a_crooked_curve_behind_the_tip_weight_moves_no_keypoint() {
        const SPACING_PX: f64 = 2.0;
        let place = |i: u32| {
            let hidden = i > 53;
            let aside = if hidden && i.is_multiple_of(2) {
                1.0
            } else {
                0.0
            };
            Pixel::new(aside, SPACING_PX * f64::from(i))
        };
        let curve: Vec<Pixel> = (0..64).map(place).collect();
        let centre = Pixel::new(0.0, 115.0);
        let radius_px = 9.0;
        let mut reading = Reading {
            evident: vec![vec![1.0; curve.len()]],
            start_px: 0.0,
            end: End {
                centre_px: 0.0,
                radius_px,
                rope_half_px: 2.0,
            },
            tips: vec![[Offset::NONE; 2]],
            radii_px: [2.0, radius_px],
            rope: Vec::new(),
            tip: Vec::new(),
            curves: vec![curve],
        };
        // Where along the curve the weight's centre was found, and how far aside of it.
        let curve = &reading.curves[0];
        let far = |px: f64| (from_end(curve, px).0 - centre).norm();
        let candidates = (0..6000).map(|i| -0.01 * f64::from(i));
        let px = candidates
            .min_by(|a, b| far(*a).total_cmp(&far(*b)))
            .unwrap();
        let (p, t) = from_end(curve, px);
        reading.end.centre_px = px;
        reading.tips[0][1].px = (centre - p).dot(&across(t));
        let tip = reading.tip(0);
        let (places, _) = reading.places(0, 24);
        assert!(distance_px(places[23], tip) < 1e-9);
        for (k, p) in places.iter().enumerate().take(20) {
            let expected = tip.y * k as f64 / 23.0;
            assert!((p.y - expected).abs() < 0.25, "{k}: {} {expected}", p.y);
        }
    }
}
