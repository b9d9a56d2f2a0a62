//! What the scene does not explain.
//!
//! A cast shadow darkens the scene along its own colour; a rope does not only that. So a
//! pixel's difference from the scene is split along and across the scene's colour: a
//! change of hue counts fully, brightening half, darkening hardly.
//!
//! A rope fills little of what surrounds it. Where evidence fills a large part of that,
//! something else is there (a person, a door, the arm), and what is seen there tells nothing
//! about the rope.

use super::super::scene::Scene;
use super::colour::{CHROMA_WEIGHT, Colour, Place, interpolated, pixel_colour, presence};
use super::curve::Pixel;
use crate::frame::ImageFrame;
use crate::vectors::widest;

/// Weights of squared differences along the scene's colour.
const BRIGHTER: f32 = 0.5;
const DARKER: f32 = 0.02;
/// Evidence begins and is full at so many times the noise.
const LEVELS: [f32; 2] = [1.5, 6.0];
/// Keeps black from having a colour (squared levels).
const BLACK: f32 = 100.0;

/// Cells along the picture's height.
const CELLS_HIGH: usize = 47;
/// What surrounds a cell: this many of them to every side.
const AROUND: usize = 4;
/// Every which pixel of a cell is looked at, in both directions.
const EVERY: usize = 4;
/// Part of what surrounds a cell from which evidence begins to count less, and from which it
/// counts nothing.
const FILLED: [f32; 2] = [0.45, 0.7];

impl Scene {
    /// Colour of a frame at a place, in the scene's light, and the scene's there; `None`
    /// outside.
    #[inline]
    pub(super) fn colours(
        &self,
        frame: &ImageFrame,
        gain: f32,
        p: Pixel,
    ) -> Option<(Colour, Colour)> {
        debug_assert_eq!(frame.luma.len(), self.image.luma.len());
        let place = Place::of(p, frame)?;
        Some((place.colour(frame, gain), place.colour(&self.image, 1.0)))
    }

    /// Distances from the scene (levels) at which evidence begins and is full.
    fn levels(&self) -> [f32; 2] {
        LEVELS.map(|l| l * self.noise)
    }

    /// Evidence (0 to 1) that a colour seen at a place is not the scene.
    pub(super) fn unexplained(&self, seen: Colour, behind: Colour) -> f32 {
        let [zero, full] = self.levels();
        ((distance(seen, behind) - zero) / (full - zero)).clamp(0.0, 1.0)
    }
}

/// Distance of a colour from what is behind, darkening along its colour left out mostly.
#[inline(always)]
fn distance(seen: Colour, behind: Colour) -> f32 {
    let (mut square, mut behind2, mut product) = (0.0, BLACK, 0.0);
    for k in 0..3 {
        let d = seen[k] - behind[k];
        square += d * d;
        behind2 += behind[k] * behind[k];
        product += d * behind[k];
    }
    let along2 = product * product / behind2;
    let weight = if product > 0.0 { BRIGHTER } else { DARKER };
    ((square - along2).max(0.0) + weight * along2).sqrt()
}

/// A frame in its scene's light.
pub(super) struct Lit<'a> {
    pub(super) scene: &'a Scene,
    pub(super) frame: &'a ImageFrame,
    /// Brightness relative to the scene.
    gain: f32,
    /// How far evidence counts, in cells of so many pixels a side.
    counts: Vec<f32>,
    cell_px: usize,
    columns: usize,
}

impl<'a> Lit<'a> {
    pub(super) fn of(frame: &'a ImageFrame, scene: &'a Scene) -> Self {
        let gain = scene.gain(frame);
        let cell_px = (frame.height_px / CELLS_HIGH).max(EVERY);
        let columns = frame.width_px.div_ceil(cell_px);
        let rows = frame.height_px.div_ceil(cell_px);
        let mut filled = vec![[0.0_f32; 2]; columns * rows];
        for v in (0..frame.height_px).step_by(EVERY) {
            for u in (0..frame.width_px).step_by(EVERY) {
                let [sum, count] = &mut filled[v / cell_px * columns + u / cell_px];
                let seen = pixel_colour(frame, gain, [u, v]);
                let behind = pixel_colour(&scene.image, 1.0, [u, v]);
                *sum += scene.unexplained(seen, behind);
                *count += 1.0;
            }
        }
        Self {
            scene,
            frame,
            gain,
            counts: counts(&filled, columns, rows),
            cell_px,
            columns,
        }
    }

    /// How far evidence at a pixel counts: from 0, in something large, to 1.
    fn count_at(&self, [u, v]: [usize; 2]) -> f32 {
        let column = (u / self.cell_px).min(self.columns - 1);
        let at = v / self.cell_px * self.columns + column;
        self.counts.get(at).copied().unwrap_or(1.0)
    }

    /// Colour at a place, and the scene's there; `None` outside.
    pub(super) fn colours(&self, p: Pixel) -> Option<(Colour, Colour)> {
        self.scene.colours(self.frame, self.gain, p)
    }

    /// Evidence (0 to 1) that something other than the scene is at a place, which may be
    /// the rope, and its colour; `None` outside.
    pub(super) fn unexplained(&self, p: Pixel) -> Option<(f32, Colour)> {
        let (seen, behind) = self.colours(p)?;
        let count = self.count_at([p.x as usize, p.y as usize]);
        Some((self.scene.unexplained(seen, behind) * count, seen))
    }

    /// Evidence (0 to 1) that something of these colours, each in all its shades, is at a place.
    pub(super) fn present(&self, colours: &[Colour], p: Pixel) -> f32 {
        self.colours(p).map_or(0.0, |(seen, behind)| {
            presence(seen, behind, colours, self.scene.noise)
        })
    }

    /// Evidence of something other than the scene in all of the frame.
    pub(super) fn map(&self) -> EvidenceMap {
        let (frame, scene) = (self.frame, &self.scene.image);
        let [zero, full] = self.scene.levels();
        let (inverse, slope) = (1.0 / self.gain, 255.0 / (full - zero));
        let mut values = vec![0; frame.luma.len()];
        widest(
            #[inline(always)]
            || {
                for (i, out) in values.iter_mut().enumerate() {
                    let colour = |frame: &ImageFrame, scale: f32| -> Colour {
                        let chroma = |c: u8| (f32::from(c) - 128.0) * (CHROMA_WEIGHT * scale);
                        let luma = f32::from(frame.luma[i]) * scale;
                        [luma, chroma(frame.cb[i / 2]), chroma(frame.cr[i / 2])]
                    };
                    let off = distance(colour(frame, inverse), colour(scene, 1.0));
                    *out = ((off - zero) * slope).clamp(0.0, 255.0) as u8;
                }
            },
        );
        for (v, row) in values.chunks_exact_mut(frame.width_px).enumerate() {
            for (u, value) in row.iter_mut().enumerate() {
                *value = (f32::from(*value) * self.count_at([u, v])) as u8;
            }
        }
        EvidenceMap {
            width: frame.width_px,
            values,
        }
    }
}

/// From evidence and number of looks per cell: means over the environment, from sums over
/// all cells above and to the left.
fn counts(filled: &[[f32; 2]], columns: usize, rows: usize) -> Vec<f32> {
    let [low, high] = FILLED;
    let wide = columns + 1;
    let mut sums = vec![[0.0_f32; 2]; wide * (rows + 1)];
    for row in 0..rows {
        let mut line = [0.0; 2];
        for column in 0..columns {
            for k in 0..2 {
                line[k] += filled[row * columns + column][k];
                sums[(row + 1) * wide + column + 1][k] = sums[row * wide + column + 1][k] + line[k];
            }
        }
    }
    let near = |at: usize, count: usize| (at.saturating_sub(AROUND), (at + AROUND + 1).min(count));
    let count = |at: usize| {
        let ((top, bottom), (left, right)) =
            (near(at / columns, rows), near(at % columns, columns));
        let [evidence, looks] = [0, 1].map(|k| {
            let sum = |row: usize, column: usize| sums[row * wide + column][k];
            sum(bottom, right) - sum(top, right) - sum(bottom, left) + sum(top, left)
        });
        ((high - evidence / looks.max(1.0)) / (high - low)).clamp(0.0, 1.0)
    };
    (0..columns * rows).map(count).collect()
}

/// Evidence of one frame, row by row, 255 for certain.
#[derive(Debug, Clone)]
pub(super) struct EvidenceMap {
    width: usize,
    values: Vec<u8>,
}

impl EvidenceMap {
    /// Evidence at a place (px), 0 to 1, between pixels; 0 outside.
    #[inline]
    pub(super) fn at(&self, p: Pixel) -> f32 {
        let (u, v) = (p.x as f32, p.y as f32);
        let [last_u, last_v] = [self.width, self.values.len() / self.width].map(|n| n - 1);
        if !(u >= 0.0 && v >= 0.0 && u < last_u as f32 && v < last_v as f32) {
            return 0.0;
        }
        let (column, row) = (u as usize, v as usize);
        let beyond = [u - column as f32, v - row as f32];
        interpolated(&self.values, self.width, [column, row], beyond) / 255.0
    }

    /// Mean over a square of `2 reach + 1` pixels a side, so that a hypothesis is drawn
    /// to what it misses by that much.
    pub(super) fn blurred(&self, reach: usize) -> Self {
        let turned = blurred_and_turned(&self.values, self.width, reach);
        let height = self.values.len() / self.width;
        Self {
            values: blurred_and_turned(&turned, height, reach),
            ..*self
        }
    }
}

/// Means over `2 reach + 1` rows, their columns as rows; beyond the picture is nothing.
fn blurred_and_turned(values: &[u8], width: usize, reach: usize) -> Vec<u8> {
    let height = values.len() / width;
    let mut out = vec![0; values.len()];
    for v in 0..height {
        let mut sums = vec![0_u32; width];
        let rows = values.chunks_exact(width).take(v + reach + 1);
        for row in rows.skip(v.saturating_sub(reach)) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += u32::from(*value);
            }
        }
        for (u, sum) in sums.into_iter().enumerate() {
            out[u * height + v] = (sum / (2 * reach as u32 + 1)) as u8;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall(stamp_ns: u64) -> ImageFrame {
        ImageFrame {
            cb: vec![120; 32],
            cr: vec![150; 32],
            stamp_ns,
            ..ImageFrame::grey([8, 8], 160)
        }
    }

    #[test]
    fn a_shadow_is_hardly_evidence_and_another_hue_is() {
        let scene = Scene::of(&[1, 2, 3].map(wall));
        let place = Place::of(Pixel::new(3.0, 3.0), &scene.image).unwrap();
        let behind = place.colour(&scene.image, 1.0);
        let seen = |scale: f32| behind.map(|c| c * scale);
        assert!(scene.unexplained(seen(0.85), behind) < 0.6);
        assert!(scene.unexplained(seen(0.95), behind) < 0.01);
        let [y, cb, cr] = behind;
        assert!(scene.unexplained([y, cb + 30.0, cr], behind) > 0.99);
        assert!(scene.unexplained(seen(1.3), behind) > 0.99);
    }

    #[test]
    fn a_walker_counts_nothing_and_a_rope_in_full() {
        let wall = |stamp_ns| ImageFrame {
            stamp_ns,
            ..ImageFrame::grey([400, 376], 160)
        };
        let scene = Scene::of(&[wall(1), wall(2), wall(3)]);
        let mut frame = wall(4);
        for row in frame.luma.chunks_exact_mut(400) {
            row[60..180].fill(250);
            row[300..310].fill(250);
        }
        let lit = Lit::of(&frame, &scene);
        assert_eq!(lit.count_at([120, 200]), 0.0);
        assert!(lit.count_at([62, 200]) < 0.9, "the edge counts less");
        assert_eq!(lit.count_at([305, 200]), 1.0);
        assert_eq!(lit.count_at([399, 375]), 1.0);
    }

    #[test]
    fn the_map_says_what_its_places_say() {
        let scene = Scene::of(&[1, 2, 3].map(wall));
        let mut frame = wall(4);
        frame.luma[8 * 4 + 4] = 184;
        let lit = Lit::of(&frame, &scene);
        let (one, _) = lit.unexplained(Pixel::new(4.0, 4.0)).unwrap();
        let assert_near = |map: &EvidenceMap, u, v, wanted: f32| {
            let found = map.at(Pixel::new(u, v));
            assert!((found - wanted).abs() < 0.005, "{found} at {u}, {v}");
        };
        assert!(one > 0.3);
        let map = lit.map();
        assert_near(&map, 4.0, 4.0, one);
        assert_near(&map, 4.5, 4.0, one / 2.0);
        // A square of nine pixels holds it, spread evenly.
        let blurred = map.blurred(1);
        assert_near(&blurred, 3.0, 5.0, one / 9.0);
        assert_eq!(blurred.at(Pixel::new(2.0, 4.0)), 0.0);
        for u in [1.0, 7.5] {
            assert_eq!(map.at(Pixel::new(u, 1.0)), 0.0);
        }
    }
}
