//! What a lamp sees of the moving things: the parts of its light that they hold up.

use super::solid::Solid;
use crate::room::lamp::Lamp;
use core::ops::Range;
use nalgebra::Vector3;

/// Texels along each side of a lamp's picture.
const SIDE: usize = 600;
/// What a lamp's picture shows around the arm's workspace (m).
const REACH_M: f64 = 1.25;
const CENTRE_M: Vector3<f64> = Vector3::new(0.45, 0.0, 0.10);

/// A lamp as a pinhole that looks at the arm.
#[derive(Debug, Clone)]
pub(crate) struct LampView {
    at_m: Vector3<f64>,
    /// Right, up, ahead.
    axes: [Vector3<f64>; 3],
    /// Texels per unit of tangent.
    scale: f64,
    radius_m: f64,
    /// Distance of the wall behind the arm (m).
    wall_m: f64,
}

impl LampView {
    pub(crate) fn of(lamp: &Lamp, wall_y_m: f64) -> Self {
        let way = CENTRE_M - lamp.at_m;
        let ahead = way.normalize();
        let right = ahead.cross(&Vector3::z()).normalize();
        let far = (wall_y_m - lamp.at_m.y) / ahead.y.max(0.1);
        Self {
            at_m: lamp.at_m,
            axes: [right, right.cross(&ahead), ahead],
            scale: SIDE as f64 / 2.0 * way.norm() / REACH_M,
            radius_m: lamp.radius_m,
            wall_m: far,
        }
    }

    /// Texel of a place, and its distance ahead (m); `None` behind the lamp.
    pub(crate) fn see(&self, p: &Vector3<f64>) -> Option<([f32; 2], f64)> {
        let way = p - self.at_m;
        let [x, y, z] = self.axes.each_ref().map(|axis| axis.dot(&way));
        let middle = SIDE as f64 / 2.0;
        let texel = [x, y].map(|c| (middle + self.scale * c / z) as f32);
        (z > 0.05).then_some((texel, z))
    }
}

/// Parts of a lamp's light that are held up, texel by texel.
#[derive(Debug, Clone)]
pub(crate) struct Cover {
    texels: Vec<f32>,
    /// First and one past the last column and row in use.
    used: [[usize; 2]; 2],
}

const NOTHING: [[usize; 2]; 2] = [[SIDE, 0], [SIDE, 0]];

/// The texels of these columns and rows, row by row.
fn spans([[low, high], [top, bottom]]: [[usize; 2]; 2]) -> impl Iterator<Item = Range<usize>> {
    (top..bottom).map(move |row| row * SIDE + low..row * SIDE + high)
}

impl Cover {
    pub(crate) fn empty() -> Self {
        Self {
            texels: vec![0.0; SIDE * SIDE],
            used: NOTHING,
        }
    }

    pub(crate) fn clear(&mut self) {
        spans(self.used).for_each(|span| self.texels[span].fill(0.0));
        self.used = NOTHING;
    }

    /// Whether anything may be held up between these texels.
    pub(crate) fn touches(&self, low: [f32; 2], high: [f32; 2]) -> bool {
        (0..2).all(|i| low[i] <= self.used[i][1] as f32 && high[i] >= self.used[i][0] as f32 - 1.0)
    }

    /// The part held up at a place between texels.
    pub(crate) fn at(&self, [x, y]: [f32; 2]) -> f32 {
        if !(x >= 0.0 && y >= 0.0 && x < (SIDE - 1) as f32 && y < (SIDE - 1) as f32) {
            return 0.0;
        }
        let (i, j) = (x as usize, y as usize);
        let (u, v) = (x - i as f32, y - j as f32);
        let row = |j: usize| {
            let at = j * SIDE + i;
            self.texels[at] + u * (self.texels[at + 1] - self.texels[at])
        };
        let near = row(j);
        near + v * (row(j + 1) - near)
    }

    /// Draws a body; a place is covered by the piece that covers it most.
    pub(crate) fn draw(&mut self, view: &LampView, solids: &[Solid]) {
        for solid in solids {
            if let (Some((a, near)), Some((b, far))) = (view.see(&solid.a_m), view.see(&solid.b_m))
            {
                let distance = (near + far) / 2.0;
                let radius = (view.scale * solid.radius_m / distance) as f32;
                // The lamp's disc, seen from the wall past the body.
                let gap = (1.0 / distance - 1.0 / view.wall_m).max(0.0);
                let soft = ((view.scale * view.radius_m * gap) as f32).max(0.6);
                self.fill([a, b], radius, soft);
            }
        }
    }

    fn fill(&mut self, [a, b]: [[f32; 2]; 2], radius: f32, soft: f32) {
        let along = [b[0] - a[0], b[1] - a[1]];
        let length2 = along[0] * along[0] + along[1] * along[1];
        let per_length2 = if length2 > 1e-9 { 1.0 / length2 } else { 0.0 };
        let reach = radius + soft;
        // A disc sliding over a band: a trapezoid, lower where the band is narrower.
        let most = (radius / soft).min(1.0);
        let slope = most / (2.0 * radius.min(soft));
        let span = |i: usize| {
            let low = (a[i].min(b[i]) - reach).ceil().clamp(0.0, SIDE as f32);
            let high = (a[i].max(b[i]) + reach).floor() + 1.0;
            [low as usize, high.clamp(0.0, SIDE as f32) as usize]
        };
        let [columns, rows] = [span(0), span(1)];
        if columns[0] >= columns[1] || rows[0] >= rows[1] {
            return;
        }
        for row in rows[0]..rows[1] {
            let dy = row as f32 - a[1];
            for column in columns[0]..columns[1] {
                let dx = column as f32 - a[0];
                let t = ((dx * along[0] + dy * along[1]) * per_length2).clamp(0.0, 1.0);
                let (ox, oy) = (dx - t * along[0], dy - t * along[1]);
                let distance = (ox * ox + oy * oy).sqrt();
                let cover = ((reach - distance) * slope).min(most);
                let texel = &mut self.texels[row * SIDE + column];
                *texel = texel.max(cover);
            }
        }
        for (used, span) in self.used.iter_mut().zip([columns, rows]) {
            *used = [used[0].min(span[0]), used[1].max(span[1])];
        }
    }

    /// Becomes the same as another.
    pub(crate) fn copy(&mut self, other: &Self) {
        self.clear();
        for span in spans(other.used) {
            self.texels[span.clone()].copy_from_slice(&other.texels[span]);
        }
        self.used = other.used;
    }

    /// Adds `weight` times what `moving` covers beyond `still`.
    pub(crate) fn add(&mut self, still: &Self, moving: &Self, weight: f32) {
        for (used, moving) in self.used.iter_mut().zip(moving.used) {
            *used = [used[0].min(moving[0]), used[1].max(moving[1])];
        }
        for span in spans(moving.used) {
            let covers = still.texels[span.clone()]
                .iter()
                .zip(&moving.texels[span.clone()]);
            for (sum, (still, moving)) in self.texels[span].iter_mut().zip(covers) {
                *sum += weight * (moving - still).max(0.0);
            }
        }
    }
}
