//! What the scene does not explain.
//!
//! A cast shadow darkens the scene along its own colour; a rope does not only that. So a
//! pixel's difference from the scene is split along and across the scene's colour: a
//! change of hue counts fully, brightening half, darkening hardly.

use super::super::background::{Background, frames_by_motion};
use super::bulk::Bulk;
use super::colour::{CHROMA_WEIGHT, Colour, SHADES, colour_at, coverage, presence};
use super::read::Lit;
use crate::frame::EyeFrame;
use crate::vectors::widest;

/// Weights of squared differences along the scene's colour.
const BRIGHTER: f32 = 0.5;
const DARKER: f32 = 0.02;
/// Evidence begins and is full at so many times the noise.
const LEVELS: [f32; 2] = [1.5, 6.0];
/// A still scene differs by less than what compression leaves around things that move
/// (levels).
const QUIETEST: f32 = 3.5;
/// Keeps black from having a colour (squared levels).
const BLACK: f32 = 100.0;

/// One eye's scene without the rope.
#[derive(Debug)]
pub(super) struct Scene {
    background: Background,
}

impl Scene {
    /// The median over frames in which much has moved.
    pub(super) fn of(frames: &[EyeFrame], count: usize) -> Self {
        let mut background = Background::uncovered(frames, &frames_by_motion(frames, count));
        background.noise = background.noise.max(QUIETEST);
        Self { background }
    }

    pub(super) fn noise(&self) -> f32 {
        self.background.noise
    }

    /// Brightness of a frame relative to the scene.
    pub(super) fn gain(&self, frame: &EyeFrame) -> f32 {
        self.background.gain(frame)
    }

    /// Colour of the scene at a place.
    pub(super) fn colour_at(&self, p: [f64; 2]) -> Option<Colour> {
        colour_at(&self.background.image, 1.0, p)
    }

    /// Evidence (0 to 1) that a colour seen at a place is not the scene.
    pub(super) fn unexplained(&self, seen: Colour, behind: Colour) -> f32 {
        let [zero, full] = LEVELS.map(|l| l * self.background.noise);
        ((distance(seen, behind) - zero) / (full - zero)).clamp(0.0, 1.0)
    }

    /// Evidence (0 to 1) at a place of a frame that something of these colours is there.
    pub(super) fn present(
        &self,
        frame: &EyeFrame,
        gain: f32,
        colours: &[Colour],
        p: [f64; 2],
    ) -> f32 {
        let seen = colour_at(frame, gain, p).zip(self.colour_at(p));
        seen.map_or(0.0, |(seen, behind)| {
            presence(coverage(seen, behind, colours, &SHADES, self.noise()))
        })
    }

    /// Evidence that what is seen at a pixel is not the scene.
    pub(super) fn unexplained_at(&self, frame: &EyeFrame, gain: f32, [u, v]: [usize; 2]) -> f32 {
        let colour = |frame: &EyeFrame, gain: f32| -> Colour {
            let [y, cb, cr] = frame.ycc(u, v).map(f32::from);
            let chroma = |c: f32| CHROMA_WEIGHT * (c - 128.0) / gain;
            [y / gain, chroma(cb), chroma(cr)]
        };
        self.unexplained(colour(frame, gain), colour(&self.background.image, 1.0))
    }

    /// Evidence in all of a frame, but for what is too large to be a rope.
    pub(super) fn map(&self, lit: &Lit<'_>) -> EvidenceMap {
        let mut map = EvidenceMap::of(lit.frame, &self.background, lit.gain);
        map.leave_out(&lit.bulk);
        map
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

/// Evidence of one frame, row by row, 255 for certain.
#[derive(Debug, Clone)]
pub(super) struct EvidenceMap {
    width: usize,
    height: usize,
    values: Vec<u8>,
}

impl EvidenceMap {
    fn of(frame: &EyeFrame, scene: &Background, gain: f32) -> Self {
        let (width, height) = (frame.width_px, frame.height_px);
        let mut values = vec![0; width * height];
        let [zero, full] = LEVELS.map(|l| l * scene.noise);
        let (inverse, slope) = (1.0 / gain, 255.0 / (full - zero));
        let mut chroma = [const { Vec::new() }; 4];
        for row in &mut chroma {
            *row = vec![0.0_f32; width];
        }
        widest(
            #[inline(always)]
            || {
                for (v, out) in values.chunks_exact_mut(width).enumerate() {
                    let half = v * width / 2..(v + 1) * width / 2;
                    let planes = [
                        (&frame.cb, inverse),
                        (&frame.cr, inverse),
                        (&scene.image.cb, 1.0),
                        (&scene.image.cr, 1.0),
                    ];
                    for (row, (plane, scale)) in chroma.iter_mut().zip(planes) {
                        let scale = CHROMA_WEIGHT * scale;
                        for (pair, c) in row.chunks_exact_mut(2).zip(&plane[half.clone()]) {
                            pair.fill((f32::from(*c) - 128.0) * scale);
                        }
                    }
                    let [cb, cr, scene_cb, scene_cr] = &chroma;
                    let row = v * width..(v + 1) * width;
                    let (luma, scene_luma) = (&frame.luma[row.clone()], &scene.image.luma[row]);
                    for u in 0..width {
                        let seen = [f32::from(luma[u]) * inverse, cb[u], cr[u]];
                        let behind = [f32::from(scene_luma[u]), scene_cb[u], scene_cr[u]];
                        out[u] = ((distance(seen, behind) - zero) * slope).clamp(0.0, 255.0) as u8;
                    }
                }
            },
        );
        Self {
            width,
            height,
            values,
        }
    }

    fn leave_out(&mut self, bulk: &Bulk) {
        let cell_px = bulk.cell_px();
        for (v, row) in self.values.chunks_exact_mut(self.width).enumerate() {
            for (cell, values) in row.chunks_mut(cell_px).enumerate() {
                let count = bulk.at([(cell * cell_px) as f64, v as f64]);
                if count < 1.0 {
                    for value in values {
                        *value = (f32::from(*value) * count) as u8;
                    }
                }
            }
        }
    }

    /// Evidence at a place (px), 0 to 1, between pixels; 0 outside.
    #[inline]
    pub(super) fn at(&self, [u, v]: [f64; 2]) -> f32 {
        let (u, v) = (u as f32, v as f32);
        let inside =
            u >= 0.0 && v >= 0.0 && u < (self.width - 1) as f32 && v < (self.height - 1) as f32;
        if !inside {
            return 0.0;
        }
        let (column, row) = (u as usize, v as usize);
        let (a, b) = (u - column as f32, v - row as f32);
        let at = row * self.width + column;
        let value = |at: usize| f32::from(self.values[at]);
        let top = value(at) + (value(at + 1) - value(at)) * a;
        let at = at + self.width;
        let bottom = value(at) + (value(at + 1) - value(at)) * a;
        (top + (bottom - top) * b) / 255.0
    }

    /// Mean over a square of `2 reach + 1` pixels a side, so that a hypothesis is drawn
    /// to what it misses by that much.
    pub(super) fn blurred(&self, reach: usize) -> Self {
        let along = |values: &[u8], width: usize, height: usize| -> Vec<u8> {
            // Running sums along columns; the result is transposed.
            let mut out = vec![0; width * height];
            let side = 2 * reach as u32 + 1;
            let mut sums = vec![0_u32; width];
            let row = |v: usize| &values[v * width..(v + 1) * width];
            let add = |sums: &mut [u32], v: usize, sign: i64| {
                for (sum, x) in sums.iter_mut().zip(row(v)) {
                    *sum = (i64::from(*sum) + sign * i64::from(*x)) as u32;
                }
            };
            (0..reach.min(height)).for_each(|v| add(&mut sums, v, 1));
            for v in 0..height {
                if v + reach < height {
                    add(&mut sums, v + reach, 1);
                }
                for (u, sum) in sums.iter().enumerate() {
                    out[u * height + v] = (sum / side) as u8;
                }
                if v >= reach {
                    add(&mut sums, v - reach, -1);
                }
            }
            out
        };
        let turned = along(&self.values, self.width, self.height);
        Self {
            values: along(&turned, self.height, self.width),
            ..*self
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        let frame = |stamp_ns| EyeFrame {
            cb: vec![120; 32],
            cr: vec![150; 32],
            stamp_ns,
            ..EyeFrame::grey([8, 8], 160)
        };
        Scene::of(&[frame(1), frame(2), frame(3)], 3)
    }

    #[test]
    fn a_shadow_is_hardly_evidence_and_another_hue_is() {
        let scene = scene();
        let behind = scene.colour_at([3.0, 3.0]).unwrap();
        let seen = |scale: f32| behind.map(|c| c * scale);
        assert!(scene.unexplained(seen(0.85), behind) < 0.6);
        assert!(scene.unexplained(seen(0.95), behind) < 0.01);
        let [y, cb, cr] = behind;
        assert!(scene.unexplained([y, cb + 30.0, cr], behind) > 0.99);
        assert!(scene.unexplained(seen(1.3), behind) > 0.99);
    }

    #[test]
    fn the_map_says_what_its_places_say() {
        let scene = scene();
        let mut frame = EyeFrame {
            cb: vec![120; 32],
            cr: vec![150; 32],
            ..EyeFrame::grey([8, 8], 160)
        };
        frame.luma[8 * 4 + 4] = 184;
        let map = scene.map(&Lit::of(&frame, &scene));
        let seen = colour_at(&frame, 1.0, [4.0, 4.0]).unwrap();
        let one = scene.unexplained(seen, scene.colour_at([4.0, 4.0]).unwrap());
        assert!(one > 0.3 && (map.at([4.0, 4.0]) - one).abs() < 0.005);
        assert!((map.at([4.5, 4.0]) - one / 2.0).abs() < 0.005);
        assert_eq!(map.at([1.0, 1.0]), 0.0);
        assert_eq!(map.at([7.5, 1.0]), 0.0);
        // A square of nine pixels holds it, spread evenly.
        let blurred = map.blurred(1);
        assert!((blurred.at([3.0, 5.0]) - one / 9.0).abs() < 0.01);
        assert_eq!(blurred.at([2.0, 4.0]), 0.0);
    }
}
