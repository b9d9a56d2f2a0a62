//! Where the still things of one eye's picture take their light from, lamp by lamp.

use super::image_view::ImageView;
use super::lamp_view::{Cover, LampView};
use nalgebra::Vector3;

/// Pixels that are looked up together, or not at all.
const STRIP: usize = 32;

/// One lamp's light on one eye's picture.
#[derive(Debug)]
pub(super) struct ShadeMap {
    width: usize,
    /// Texel of the lamp's picture and part of the light, pixel by pixel.
    pixels: Vec<([f32; 2], f32)>,
    /// First and last texels of each strip.
    strips: Vec<[[f32; 2]; 2]>,
}

impl ShadeMap {
    /// `seen` tells where each pixel's surface is, and which part of its light is the
    /// lamp's.
    pub(super) fn new(
        image: &ImageView,
        view: &LampView,
        seen: impl Iterator<Item = (Vector3<f64>, f32)>,
    ) -> Self {
        let width = image.size_px().0;
        let pixels: Vec<_> = seen
            .map(|(at_m, share)| match view.see(&at_m) {
                Some((texel, _)) if share > 0.0 => (texel, share),
                _ => ([-1e6; 2], 0.0),
            })
            .collect();
        let strips = pixels
            .chunks_exact(width)
            .flat_map(|row| row.chunks(STRIP).map(bounds))
            .collect();
        Self {
            width,
            pixels,
            strips,
        }
    }

    /// Adds the light that row `v` lacks to `lack`, from 0 to 1 a pixel. Returns the
    /// first and one past the last pixel that may lack some.
    pub(super) fn darken(&self, v: usize, cover: &Cover, lack: &mut [f32]) -> (usize, usize) {
        let row = &self.pixels[v * self.width..][..self.width];
        let per_row = self.width.div_ceil(STRIP);
        let strips = &self.strips[v * per_row..][..per_row];
        let (mut from, mut to) = (self.width, 0);
        for (i, [low, high]) in strips.iter().enumerate() {
            if !cover.touches(*low, *high) {
                continue;
            }
            let (first, end) = (i * STRIP, ((i + 1) * STRIP).min(self.width));
            for (lack, (texel, share)) in lack[first..end].iter_mut().zip(&row[first..end]) {
                *lack += share * cover.at(*texel);
            }
            (from, to) = (from.min(first), end);
        }
        (from, to)
    }
}

fn bounds(strip: &[([f32; 2], f32)]) -> [[f32; 2]; 2] {
    let lit = strip.iter().filter(|(_, share)| *share > 0.0);
    let none = [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]];
    lit.fold(none, |[low, high], (texel, _)| {
        [
            [low[0].min(texel[0]), low[1].min(texel[1])],
            [high[0].max(texel[0]), high[1].max(texel[1])],
        ]
    })
}
