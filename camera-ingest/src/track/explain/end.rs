//! The rope's free end in the median picture: a band that ends in a disc.

use nalgebra::{Matrix3, Matrix3x2, Vector3};

use super::curve::{Pixel, distance_px};
use super::ends::EndPicture;

/// Where the tip weight is, from the hypothesis's end on (px).
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub(super) centre_px: f64,
    pub(super) radius_px: f64,
    /// Half the rope's width.
    pub(super) rope_half_px: f64,
}

impl End {
    /// How many of a curve's points the tip weight does not hide.
    pub(super) fn nodes_shown(&self, curve: &[Pixel]) -> usize {
        let mut from_end_px = -self.centre_px;
        for node in (1..curve.len()).rev() {
            if from_end_px >= self.radius_px {
                return node + 1;
            }
            from_end_px += distance_px(curve[node - 1], curve[node]);
        }
        1
    }
}

/// Radii that are tried, and steps of the rounds (px).
const RADII_PX: [f64; 2] = [1.5, 17.5];
const STEPS_PX: [f64; 3] = [2.0, 0.67, 0.22];
/// An edge is blurred over so much (px).
const BLUR_PX: f64 = 1.5;

/// The end of a rope of this half width that fits the evidence best; the centre lies within
/// `reach_px` of the curve's end, and the disc is at least `least` times as evident as the
/// rope.
pub(super) fn find(picture: &EndPicture, rope_half_px: f64, reach_px: f64, least: f64) -> End {
    let fit = |centre_px: f64, radius_px: f64| {
        let end = End {
            centre_px,
            radius_px,
            rope_half_px,
        };
        (misfit(picture, &end, least), end)
    };
    let grid = |low: f64, high: f64, step: f64| {
        let count = ((high - low) / step).round().max(0.0) as usize;
        (0..=count).map(move |i| low + step * i as f64)
    };
    let best = |centres: [f64; 2], radii: [f64; 2], step: f64| {
        grid(centres[0], centres[1], step)
            .flat_map(|c| grid(radii[0], radii[1], step).map(move |r| (c, r)))
            .map(|(c, r)| fit(c, r))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(fit(0.0, rope_half_px).1, |(_, end)| end)
    };
    let mut end = best([-reach_px, reach_px], RADII_PX, STEPS_PX[0]);
    for pair in STEPS_PX.windows(2) {
        let around = |px: f64| [px - pair[0], px + pair[0]];
        let [smallest, largest] = around(end.radius_px);
        let radii = [smallest.max(RADII_PX[0]), largest];
        end = best(around(end.centre_px), radii, pair[1]);
    }
    end
}

/// How much of a pixel lies within an edge that is so far away (px, inside positive).
fn inside(px: f64) -> f64 {
    (px / BLUR_PX + 0.5).clamp(0.0, 1.0)
}

/// What a band and a disc, each evenly evident, leave of the picture's evidence (sum of
/// squares).
fn misfit(picture: &EndPicture, end: &End, least: f64) -> f64 {
    let (mut normal, mut sums, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for (along, across, evidence) in picture.places() {
        let disc = inside(end.radius_px - (along - end.centre_px).hypot(across));
        let band = inside(end.rope_half_px - across.abs()) * inside(end.centre_px - along);
        let model = Vector3::new(1.0, disc, band * (1.0 - disc));
        normal += model * model.transpose();
        sums += model * evidence;
        square += evidence * evidence;
    }
    let ridge = Matrix3::identity() * 1e-6;
    let levels = (normal + ridge).try_inverse().unwrap_or_default() * sums;
    if levels[1] >= least * levels[2].max(0.0) {
        return square - sums.dot(&levels);
    }
    // As evident as it must be at least: one level for both.
    let both = Matrix3x2::new(1.0, 0.0, 0.0, least, 0.0, 1.0);
    let (normal, sums) = (both.tr_mul(&(normal * both)), both.tr_mul(&sums));
    let levels = normal.try_inverse().unwrap_or_default() * sums;
    square - sums.dot(&levels)
}

#[cfg(test)]
mod tests {
    use super::super::ends::Window;
    use super::*;

    /// A curve that ends at the origin, drawn straight down, and its picture.
    fn picture(evidence: impl Fn(Pixel) -> f32) -> EndPicture {
        let window = Window {
            before: 45,
            beyond: 45,
            reach: 24,
        };
        let place = |i| Pixel::new(0.0, 5.0 * f64::from(i - 19));
        let curve: Vec<Pixel> = (0..20).map(place).collect();
        let sample = |p| Some((evidence(p), [0.0; 3]));
        EndPicture::of(window, std::iter::once((curve, sample)))
    }

    #[test]
    fn weights_are_found_with_their_size() {
        for (centre, radius, rope, faint) in [
            (3.0, 9.0, 3.0, 1.0),
            (-4.5, 5.0, 2.5, 1.0),
            // Hardly evident, or hardly thicker than the rope.
            (2.0, 8.0, 3.0, 0.25),
            (6.0, 3.5, 3.0, 1.0),
        ] {
            let picture = picture(|p| {
                let (u, v) = (p.x, p.y);
                let disc = (radius - u.hypot(v - centre) + 0.5).clamp(0.0, 1.0);
                let band = (rope - u.abs() + 0.5).clamp(0.0, 1.0);
                let band = if v < centre { band } else { 0.0 };
                (0.05 + 0.9 * (disc * faint + (1.0 - disc) * band)) as f32
            });
            let found = find(&picture, picture.rope_half_px(), 12.0, 0.0);
            let off = [
                found.centre_px - centre,
                found.radius_px - radius,
                found.rope_half_px - rope,
            ];
            assert!(off.iter().all(|o| o.abs() < 0.6), "{found:?}: {off:?}");
        }
    }
}
