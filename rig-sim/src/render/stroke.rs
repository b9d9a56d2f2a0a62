//! A capsule in the picture: two ends with radii and depths, shaded like a
//! rounded solid under one soft light.

use super::colour::{Ycc, lit};
use super::image_view::ImageView;
use super::layer::{Cell, RowLayer};
use super::lighting::Lighting;
use super::solid::{Material, Solid};
use super::weave::Weave;

/// A capsule projected into one eye.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stroke {
    a_px: [f32; 2],
    along_px: [f32; 2],
    per_length2: f32,
    radius_px: [f32; 2],
    depth_m: [f32; 2],
    radius_m: f32,
    material: Material,
    arc_m: [f32; 2],
    rows: (usize, usize),
}

/// Strokes of one body under one light, and the rows they touch together.
#[derive(Debug)]
pub(super) struct Strokes {
    all: Vec<Stroke>,
    light: Lighting,
    rows: (usize, usize),
}

impl Strokes {
    /// Draws row `v` into a layer that is cleared first.
    pub(super) fn draw_row(&self, v: usize, layer: &mut RowLayer) {
        layer.clear();
        let touches = |(top, bottom): (usize, usize)| top <= v && v < bottom;
        if touches(self.rows) {
            for stroke in self.all.iter().filter(|s| touches(s.rows)) {
                stroke.draw_row(v, &self.light, layer);
            }
        }
    }

    /// What an eye sees of a body.
    pub(super) fn of(
        image: &ImageView,
        light: &Lighting,
        solids: impl IntoIterator<Item = Solid>,
    ) -> Self {
        let seen = solids.into_iter().filter_map(|s| Stroke::new(image, &s));
        let all: Vec<_> = seen.collect();
        let rows = all.iter().fold((usize::MAX, 0), |(top, bottom), s| {
            (top.min(s.rows.0), bottom.max(s.rows.1))
        });
        Self {
            all,
            light: *light,
            rows,
        }
    }
}

impl Stroke {
    /// The capsule in the picture, if in front of the eye.
    fn new(image: &ImageView, solid: &Solid) -> Option<Self> {
        let (a, b) = (image.see(&solid.a_m)?, image.see(&solid.b_m)?);
        let along_px = [
            (b.pixel[0] - a.pixel[0]) as f32,
            (b.pixel[1] - a.pixel[1]) as f32,
        ];
        let length2 = along_px[0] * along_px[0] + along_px[1] * along_px[1];
        let mut stroke = Self {
            a_px: a.pixel.map(|v| v as f32),
            along_px,
            per_length2: if length2 > 1e-9 { 1.0 / length2 } else { 0.0 },
            radius_px: [a, b].map(|end| (end.px_per_m * solid.radius_m) as f32),
            depth_m: [a.depth_m as f32, b.depth_m as f32],
            radius_m: solid.radius_m as f32,
            material: solid.material,
            arc_m: solid.arc_m.map(|v| v as f32),
            rows: (0, 0),
        };
        stroke.rows = stroke.find_rows(image.size_px().1);
        Some(stroke)
    }

    fn reach_px(&self) -> f32 {
        self.radius_px[0].max(self.radius_px[1]).max(0.5) + 0.5
    }

    /// First and one past the last row touched, within a picture of `height` rows.
    fn find_rows(&self, height: usize) -> (usize, usize) {
        let (v0, v1) = (self.a_px[1], self.a_px[1] + self.along_px[1]);
        let low = (v0.min(v1) - self.reach_px()).ceil().max(0.0) as usize;
        let high = (v0.max(v1) + self.reach_px()).floor() + 1.0;
        (low, (high.max(0.0) as usize).min(height))
    }

    /// First and one past the last column touched in row `v`.
    fn columns(&self, v: f32, width: usize) -> (usize, usize) {
        let reach = self.reach_px();
        let (u0, u1) = (self.a_px[0], self.a_px[0] + self.along_px[0]);
        let (mut low, mut high) = (u0.min(u1) - reach, u0.max(u1) + reach);
        let rise = self.along_px[1];
        if rise.abs() > 1e-3 {
            // Where the row crosses the band around the infinite axis.
            let middle = self.a_px[0] + (v - self.a_px[1]) * self.along_px[0] / rise;
            let half = reach / (rise.abs() * self.per_length2.sqrt());
            low = low.max(middle - half);
            high = high.min(middle + half);
        }
        let from = low.ceil().max(0.0) as usize;
        (from, ((high.floor() + 1.0).max(0.0) as usize).min(width))
    }

    fn draw_row(&self, v: usize, light: &Lighting, layer: &mut RowLayer) {
        let dv = v as f32 - self.a_px[1];
        let (from, to) = self.columns(v as f32, layer.width());
        for u in from..to {
            let du = u as f32 - self.a_px[0];
            let dot = du * self.along_px[0] + dv * self.along_px[1];
            let t = (dot * self.per_length2).clamp(0.0, 1.0);
            let (ou, ov) = (du - t * self.along_px[0], dv - t * self.along_px[1]);
            let radius = self.radius_px[0] + t * (self.radius_px[1] - self.radius_px[0]);
            let distance = (ou * ou + ov * ov).sqrt();
            // Narrower than a pixel: the same light, spread over one pixel.
            let thin = (2.0 * radius).min(1.0);
            let cover = (radius.max(0.5) - distance + 0.5).clamp(0.0, 1.0) * thin;
            if cover <= 0.0 {
                continue;
            }
            let (nu, nv) = (ou / radius, ov / radius);
            let facing = (1.0 - nu * nu - nv * nv).max(0.0).sqrt();
            let depth = self.depth_m[0] + t * (self.depth_m[1] - self.depth_m[0]);
            layer.put(
                u,
                Cell {
                    cover,
                    depth_m: depth - facing * self.radius_m,
                    colour: self.shade(light, self.colour(t, [nu, nv]), [nu, nv, facing]),
                },
            );
        }
    }

    /// The surface's own colour at a part of its length, off its axis by a part of its
    /// radius (right, down).
    fn colour(&self, t: f32, [nu, nv]: [f32; 2]) -> Ycc {
        if self.material.weave == Weave::Plain {
            return self.material.colour;
        }
        let arc_m = self.arc_m[0] + t * (self.arc_m[1] - self.arc_m[0]);
        let per_length = self.per_length2.sqrt();
        let across = (nv * self.along_px[0] - nu * self.along_px[1]) * per_length;
        self.material.weave.at(self.material.colour, arc_m, across)
    }

    /// Lambert's law with a highlight halfway between lamp and camera.
    fn shade(&self, light: &Lighting, colour: Ycc, normal: [f32; 3]) -> Ycc {
        let dot =
            |l: [f32; 3]| (l[0] * normal[0] + l[1] * normal[1] + l[2] * normal[2]).clamp(0.0, 1.0);
        let mirror = dot(light.halfway);
        let mirror = mirror * mirror * mirror * mirror;
        let mirror = mirror * mirror * mirror;
        lit(
            colour,
            light.ambient + light.lamp * dot(light.towards),
            self.material.gloss * mirror * mirror,
        )
    }
}
