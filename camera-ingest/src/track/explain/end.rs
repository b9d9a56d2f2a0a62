//! The rope's free end in the median picture: a band that ends in a disc.

use nalgebra::{Matrix3, Matrix3x2, Vector3};

use super::curve::{Pixel, distance_px};
use super::ends::{COLUMNS, END_REACH, EndPicture};
use crate::vectors::widest;

/// Where the tip weight is, from the hypothesis's end on (px).
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub(super) centre_px: f64,
    pub(super) radius_px: f64,
    /// Half the rope's width.
    pub(super) rope_half_px: f64,
}

impl End {
    /// How many of a curve's points the tip weight, blurred as it is, does not hide.
    pub(super) fn nodes_shown(&self, curve: &[Pixel]) -> usize {
        let mut before_px = self.centre_px;
        for node in (1..curve.len()).rev() {
            if before_px >= self.radius_px + 0.5 * BLUR_PX {
                return node + 1;
            }
            before_px += distance_px(curve[node - 1], curve[node]);
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
    let prepared = Prepared::of(picture, rope_half_px);
    let fit = |centre_px: f64, radius_px: f64| {
        let end = End {
            centre_px,
            radius_px,
            rope_half_px,
        };
        (prepared.misfit(&end, least), end)
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
#[inline(always)]
fn inside(px: f64) -> f64 {
    (px / BLUR_PX + 0.5).clamp(0.0, 1.0)
}

/// A median picture, with what does not depend on where a rope of one width ends.
struct Prepared<'a> {
    picture: &'a EndPicture,
    /// Squared distance of each column from the curve, and how much of it the rope fills.
    square_px2: [f64; COLUMNS],
    filled: [f64; COLUMNS],
    /// Sums of the evidence and of its square.
    seen: [f64; 2],
}

impl<'a> Prepared<'a> {
    fn of(picture: &'a EndPicture, rope_half_px: f64) -> Self {
        let px = core::array::from_fn(|c| c as f64 - END_REACH as f64);
        let evidence = || picture.rows().flat_map(|(_, row)| row);
        Self {
            picture,
            square_px2: px.map(|px: f64| px * px),
            filled: px.map(|px: f64| inside(rope_half_px - px.abs())),
            seen: [evidence().sum(), evidence().map(|e| e * e).sum()],
        }
    }

    /// What the band and a disc, each evenly evident, leave of the picture's evidence (sum of
    /// squares).
    fn misfit(&self, end: &End, least: f64) -> f64 {
        // Columns side by side, so that they are summed in wide vectors.
        let mut columns = [[0.0; COLUMNS]; 7];
        let [
            discs,
            bands,
            discs2,
            products,
            bands2,
            seen_discs,
            seen_bands,
        ] = &mut columns;
        let mut rows = 0;
        widest(
            #[inline(always)]
            || {
                for (along_px, evidence) in self.picture.rows() {
                    rows += 1;
                    let beyond_px = along_px - end.centre_px;
                    let shown = inside(-beyond_px);
                    for c in 0..COLUMNS {
                        let far_px = (beyond_px * beyond_px + self.square_px2[c]).sqrt();
                        let disc = inside(end.radius_px - far_px);
                        let band = self.filled[c] * shown * (1.0 - disc);
                        discs[c] += disc;
                        bands[c] += band;
                        discs2[c] += disc * disc;
                        products[c] += disc * band;
                        bands2[c] += band * band;
                        seen_discs[c] += disc * evidence[c];
                        seen_bands[c] += band * evidence[c];
                    }
                }
            },
        );
        let [disc, band, disc2, product, band2, seen_disc, seen_band] =
            columns.map(|column| column.iter().sum::<f64>());
        let [seen, seen2] = self.seen;
        let all = (rows * COLUMNS) as f64;
        let normal = Matrix3::new(all, disc, band, disc, disc2, product, band, product, band2);
        residual(
            normal,
            Vector3::new(seen, seen_disc, seen_band),
            seen2,
            least,
        )
    }
}

/// Residual sum of squares for the best levels of ground, disc and band, by the normal
/// equations.
fn residual(normal: Matrix3<f64>, sums: Vector3<f64>, square: f64, least: f64) -> f64 {
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

    /// Sums column by column are those of the model, place by place.
    #[test]
    fn the_misfit_is_that_of_the_model() {
        let evidence = |p: Pixel| (0.5 + 0.4 * (0.3 * p.x).sin() * (0.2 * p.y + 1.0).cos()) as f32;
        let picture = picture(evidence);
        let end = End {
            centre_px: 3.3,
            radius_px: 7.2,
            rope_half_px: 2.6,
        };
        let (mut normal, mut sums, mut square) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
        for (along, row) in picture.rows() {
            for (c, evidence) in row.iter().enumerate() {
                let across = c as f64 - END_REACH as f64;
                let disc = inside(end.radius_px - (along - end.centre_px).hypot(across));
                let band = inside(end.rope_half_px - across.abs()) * inside(end.centre_px - along);
                let model = Vector3::new(1.0, disc, band * (1.0 - disc));
                normal += model * model.transpose();
                sums += model * *evidence;
                square += evidence * evidence;
            }
        }
        for least in [0.0, 0.85, 50.0] {
            let found = Prepared::of(&picture, end.rope_half_px).misfit(&end, least);
            let expected = residual(normal, sums, square, least);
            assert!(
                (found - expected).abs() < 1e-9 * square,
                "{found} {expected}"
            );
        }
    }

    /// A curve that ends at the origin, drawn straight down, and its picture.
    fn picture(evidence: impl Fn(Pixel) -> f32) -> EndPicture {
        let window = Window {
            before: 45,
            beyond: 45,
            reach: END_REACH,
        };
        let place = |i| Pixel::new(0.0, 5.0 * f64::from(i - 19));
        let curve: Vec<Pixel> = (0..20).map(place).collect();
        let sample = |p| Some(evidence(p));
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
