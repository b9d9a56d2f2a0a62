//! One eye's picture, row by row: the room in its shadows, and the moving things over it.

use super::bodies::Spell;
use super::colour::{Ycc, lit};
use super::environment::View;
use super::image_view::ImageView;
use super::lamp_view::Cover;
use super::layer::{RowLayer, composite};
use super::sensor::pack_yuyv;
use crate::room::lamp::level;

/// What one eye keeps between frames.
#[derive(Debug)]
pub(super) struct ImageCanvas {
    pub(super) image: ImageView,
    pub(super) view: View,
    room_yuyv: Vec<u8>,
    arm: RowLayer,
    others: RowLayer,
    rope: RowLayer,
    sum: Vec<Ycc>,
    /// Parts of the light that a row's pixels lack.
    lack: Vec<f32>,
    /// Brightness for parts of the light lacked.
    darker: Vec<f32>,
}

/// Steps of [`ImageCanvas::darker`].
const LACKS: usize = 512;

impl ImageCanvas {
    pub(super) fn new(image: ImageView, view: View) -> Self {
        let mut seen = view.picture.clone();
        for (pixel, veil) in seen.iter_mut().zip(&view.veil) {
            pixel[0] += veil;
        }
        let mut room_yuyv = vec![0; seen.len() * 2];
        pack_yuyv(&seen, &mut room_yuyv);
        let width = image.size_px().0;
        let lack = |i: usize| i as f64 / (LACKS - 1) as f64;
        Self {
            image,
            view,
            room_yuyv,
            arm: RowLayer::new(width),
            others: RowLayer::new(width),
            rope: RowLayer::new(width),
            sum: vec![[0.0; 3]; width],
            lack: vec![0.0; width],
            darker: (0..LACKS).map(|i| level(1.0 - lack(i)) as f32).collect(),
        }
    }

    /// Draws row `v` of this eye: the room in the lamps' shadows, and over it the mean of
    /// the sub-frames, each with its weight in this row, where any of them has something.
    /// Returns how many pixels are not the room's as it stands.
    pub(super) fn draw_row(
        &mut self,
        v: usize,
        spells: &[Spell],
        covers: &[Cover],
        weight_of: impl Fn(usize) -> f32,
        out: &mut [u8],
    ) -> usize {
        let width = self.image.size_px().0;
        out.copy_from_slice(&self.room_yuyv[v * width * 2..(v + 1) * width * 2]);
        let (mut from, mut to) = self.darken(v, covers);
        let mut total = 0.0;
        for spell in spells {
            let weights = spell.first..spell.first + spell.ropes.len();
            let still: f32 = weights.clone().map(&weight_of).sum();
            if still <= 0.0 {
                continue;
            }
            total += still;
            spell.arm.draw_row(v, &mut self.arm);
            spell.others.draw_row(v, &mut self.others);
            // What stands still counts once, with the weight of the whole spell;
            for (low, high) in apart(self.arm.used(), self.others.used()) {
                self.add_still(v, (low, high), still);
                (from, to) = (from.min(low), to.max(high));
            }
            // each rope adds only what it changes.
            for (rope, weight) in spell.ropes.iter().zip(weights.map(&weight_of)) {
                if weight > 0.0 {
                    rope.draw_row(v, &mut self.rope);
                    let (low, high) = self.rope.used();
                    self.add_rope(v, (low, high), weight);
                    (from, to) = (from.min(low), to.max(high));
                }
            }
        }
        if from >= to {
            return 0;
        }
        // Chroma belongs to pairs of pixels.
        let (from, to) = (from & !1, ((to + 1) & !1).min(width));
        let share = if total > 0.0 { 1.0 / total } else { 0.0 };
        for u in from..to {
            // Light was gathered before the lens dims it; the room's is dimmed.
            let dim = self.view.vignette.at(u as f32, v as f32) * share;
            let room = self.ground(u, v);
            for i in 0..3 {
                self.sum[u][i] = room[i] + self.sum[u][i] * dim;
            }
        }
        if !self.view.veil.is_empty() {
            let veil = &self.view.veil[v * width + from..v * width + to];
            for (pixel, veil) in self.sum[from..to].iter_mut().zip(veil) {
                pixel[0] += veil;
            }
        }
        pack_yuyv(&self.sum[from..to], &mut out[from * 2..to * 2]);
        self.sum[from..to].fill([0.0; 3]);
        self.lack[from..to].fill(0.0);
        to - from
    }

    /// Finds what light the pixels of a row lack, and which pixels may lack some.
    fn darken(&mut self, v: usize, covers: &[Cover]) -> (usize, usize) {
        let none = (self.lack.len(), 0);
        let lamps = self.view.shades.iter().zip(covers);
        lamps.fold(none, |(from, to), (shade, cover)| {
            let (low, high) = shade.darken(v, cover, &mut self.lack);
            (from.min(low), to.max(high))
        })
    }

    /// The room in its shadows at a pixel, dimmed by the lens.
    fn ground(&self, u: usize, v: usize) -> Ycc {
        let room = self.view.picture[v * self.arm.width() + u];
        let lack = (self.lack[u] * (LACKS - 1) as f32) as usize;
        lit(room, self.darker[lack.min(LACKS - 1)], 0.0)
    }

    /// The room's colour at a pixel before the lens dims it.
    fn behind(&self, u: usize, v: usize) -> Ycc {
        let dim = self.view.vignette.at(u as f32, v as f32);
        self.ground(u, v).map(|c| c / dim)
    }

    /// Adds what arm and others change against the room, `weight` times.
    fn add_still(&mut self, v: usize, (low, high): (usize, usize), weight: f32) {
        for u in low..high {
            let behind = self.behind(u, v);
            let seen = composite([&self.arm, &self.others], u, behind);
            for i in 0..3 {
                self.sum[u][i] += (seen[i] - behind[i]) * weight;
            }
        }
    }

    /// Adds what the rope changes against arm, others and room, `weight` times.
    fn add_rope(&mut self, v: usize, (low, high): (usize, usize), weight: f32) {
        for u in low..high {
            if self.rope.cell(u).cover > 0.0 {
                let behind = self.behind(u, v);
                let without = composite([&self.arm, &self.others], u, behind);
                let with = composite([&self.arm, &self.others, &self.rope], u, behind);
                for i in 0..3 {
                    self.sum[u][i] += (with[i] - without[i]) * weight;
                }
            }
        }
    }
}

/// Two spans as spans that do not overlap, empty ones left out.
fn apart(a: (usize, usize), b: (usize, usize)) -> impl Iterator<Item = (usize, usize)> {
    let overlap = a.0 < b.1 && b.0 < a.1;
    let spans = if overlap {
        [(a.0.min(b.0), a.1.max(b.1)), (0, 0)]
    } else {
        [a, b]
    };
    spans.into_iter().filter(|(low, high)| low < high)
}
