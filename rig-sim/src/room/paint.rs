//! Surfaces as formulas: what a wall, a board or a book looks like at a place on it.

use crate::render::texture::{fractal, lattice, noise};
use nalgebra::Vector3;

/// Colour in video levels (0 to 255) under full light.
pub(crate) type Rgb = Vector3<f64>;

/// A surface; places on it are metres to the right and up.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Paint {
    pub(crate) kind: PaintKind,
    /// Its main colour, and its second one.
    pub(crate) rgb: Rgb,
    pub(crate) other: Rgb,
    /// Size of what repeats (m).
    pub(crate) size_m: f64,
    /// What differs between two surfaces of one kind.
    pub(crate) seed: u64,
}

/// Kinds of surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PaintKind {
    /// Smooth, with faint grain.
    Laminate,
    /// Rough, with stains.
    Plaster,
    /// Courses of brick in mortar.
    Brick,
    /// Boards side by side, upright on walls, to the right on floors.
    Boards,
    /// Shelves full of books.
    Books,
    /// Folds that hang down.
    Curtain,
    /// Square tiles.
    Tiles,
    /// Pile.
    Carpet,
    /// Upright stripes.
    Stripes,
    /// Squares in two colours.
    Checks,
    /// Discs on a ground.
    Dots,
    /// Patches of colour like a photograph.
    Photograph,
    /// Lines of writing on paper.
    Writing,
    /// Panes that glow, in a frame.
    Window,
}

/// Parts 0 to 1 of `t`, and its whole part.
fn split(t: f64) -> (f64, i64) {
    (t.rem_euclid(1.0), t.floor() as i64)
}

impl Paint {
    /// Colour at a place.
    pub(crate) fn at(&self, s: f64, t: f64) -> Rgb {
        let (size, seed) = (self.size_m, self.seed);
        match self.kind {
            PaintKind::Laminate => self.rgb * (1.0 + 0.03 * fractal(s * 6.0, t * 50.0, 2, seed)),
            PaintKind::Plaster => {
                let rough = 0.04 * fractal(s * 45.0, t * 45.0, 3, seed);
                let stains = 0.09 * fractal(s * 1.9, t * 1.9, 4, seed ^ 5);
                self.rgb * (1.0 + rough + stains)
            }
            PaintKind::Brick => self.brick(s, t),
            PaintKind::Boards => self.boards(s, t),
            PaintKind::Books => self.books(s, t),
            PaintKind::Curtain => {
                let sway = 1.6 * noise(s * 2.1, t * 0.5, seed) + 0.7 * noise(s * 6.0, 0.3, seed);
                let fold = (s / size + sway) * core::f64::consts::TAU;
                let depth = 0.7 * fold.sin() + 0.3 * (2.0 * fold + 1.0).sin();
                self.rgb * (0.80 + 0.20 * depth + 0.03 * noise(s * 200.0, t * 200.0, seed))
            }
            PaintKind::Tiles => {
                let ((x, i), (y, j)) = (split(s / size), split(t / size));
                let joint = x.min(y) < 0.006 / size;
                let tone = 1.0 + 0.05 * lattice(i, j, seed) + 0.04 * noise(s * 9.0, t * 9.0, seed);
                self.rgb * if joint { 0.6 } else { tone }
            }
            PaintKind::Carpet => {
                let pile = 0.10 * fractal(s * 160.0, t * 160.0, 2, seed);
                self.rgb * (1.0 + pile + 0.06 * noise(s * 2.0, t * 2.0, seed))
            }
            PaintKind::Stripes => self.either(split(s / size).0 < 0.5),
            PaintKind::Checks => self.either((split(s / size).1 + split(t / size).1) % 2 == 0),
            PaintKind::Dots => {
                let (x, y) = (split(s / size).0 - 0.5, split(t / size).0 - 0.5);
                self.either(x.hypot(y) > 0.3)
            }
            PaintKind::Photograph => self.photograph(s, t),
            PaintKind::Writing => {
                let ((row, line), (word, _)) = (split(t / size), split(s / (size * 3.0)));
                let gap = lattice((s / (size * 3.0)).floor() as i64, line, seed) > 0.5;
                let ink =
                    row < 0.45 && word < 0.85 && !gap && noise(s * 900.0, t * 600.0, 2) > -0.2;
                self.either(!ink)
            }
            PaintKind::Window => {
                let ((x, _), (y, _)) = (split(s / size), split(t / size));
                let bar = x.min(y) < 0.07;
                let sky = 1.0 + 0.08 * fractal(s * 4.0, t * 4.0, 3, seed);
                if bar { self.other } else { self.rgb * sky }
            }
        }
    }

    /// Whether it gives light of its own at a place.
    pub(crate) fn glows(&self, s: f64, t: f64) -> bool {
        let (x, y) = (split(s / self.size_m).0, split(t / self.size_m).0);
        self.kind == PaintKind::Window && x.min(y) >= 0.07
    }

    /// Its mean over a square of 2 m.
    pub(crate) fn mean(&self) -> Rgb {
        const ROWS: i32 = 30;
        let place = |i: i32| (f64::from(i) + 0.37) * 2.0 / f64::from(ROWS);
        let all = (0..ROWS * ROWS).map(|i| self.at(place(i % ROWS), place(i / ROWS)));
        all.sum::<Rgb>() / f64::from(ROWS * ROWS)
    }

    fn either(&self, first: bool) -> Rgb {
        if first { self.rgb } else { self.other }
    }

    fn brick(&self, s: f64, t: f64) -> Rgb {
        let (height, length) = (self.size_m, self.size_m * 3.0);
        let (row, j) = split(t / height);
        let (along, i) = split(s / length + 0.5 * (j.rem_euclid(2)) as f64);
        let joint_m = 0.010 + 0.002 * noise(s * 40.0, t * 40.0, self.seed);
        let edge_m = (row.min(1.0 - row) * height).min(along.min(1.0 - along) * length);
        if edge_m < joint_m / 2.0 {
            return self.other * (1.0 + 0.06 * noise(s * 200.0, t * 200.0, self.seed));
        }
        // Fired more or less, each brick by itself.
        let tone = |k: u64| lattice(i, j, self.seed ^ k);
        let fired = self.rgb * (1.0 + 0.16 * tone(1)) + Rgb::new(9.0, -3.0, -8.0) * tone(2);
        let rough = 0.09 * fractal(s * 60.0, t * 60.0, 3, self.seed);
        let bevel = if row > 1.0 - 0.14 { 1.06 } else { 1.0 };
        fired * ((1.0 + rough) * bevel)
    }

    fn boards(&self, s: f64, t: f64) -> Rgb {
        let (across, i) = split(s / self.size_m);
        let tone = 1.0 + 0.13 * lattice(i, 0, self.seed);
        let shift = 10.0 * lattice(i, 1, self.seed);
        let fine = 0.22 * fractal(s * 130.0, t * 2.5 + shift, 3, self.seed);
        let coarse = 0.16 * fractal(s * 20.0 + shift, t * 0.8, 3, self.seed ^ 9);
        let grain = fine + coarse;
        // A knot here and there.
        let knot_t = (t / 0.7 + shift).rem_euclid(1.0) - 0.5;
        let knot = (across - 0.5 - 0.3 * lattice(i, 2, self.seed)).hypot(knot_t * 7.0);
        let dark = if knot < 0.09 { 0.55 } else { 1.0 };
        let gap = across.min(1.0 - across) * self.size_m < 0.002;
        self.rgb * ((tone + grain) * dark * if gap { 0.4 } else { 1.0 })
    }

    /// Shelves `size_m` apart, books of all colours, gaps between some.
    fn books(&self, s: f64, t: f64) -> Rgb {
        const THICK_M: f64 = 0.034;
        let (up, shelf) = split(t / self.size_m);
        let board_m = up * self.size_m;
        if board_m < 0.022 {
            return self.rgb * (1.0 + 0.08 * fractal(s * 5.0, t * 80.0, 2, self.seed));
        }
        // Books stand in places of about their thickness, widened or narrowed by chance.
        let warped = s / THICK_M + 0.8 * noise(s * 19.0, shelf as f64 * 7.3, self.seed);
        let (across, book) = split(warped);
        let chance = |k: u64| lattice(book, shelf, self.seed ^ k) * 0.5 + 0.5;
        let tall_m = self.size_m * (0.55 + 0.33 * chance(1));
        if board_m > tall_m || chance(2) < 0.10 {
            // The back of the shelf, in the dark.
            return self.rgb * 0.35;
        }
        let hue = chance(3);
        let grey = 45.0 + 140.0 * chance(4);
        let dyed = Rgb::new(chance(5), chance(6), chance(7)).map(|c| grey * (0.55 + 0.75 * c));
        let cloth = if hue < 0.3 { Rgb::repeat(grey) } else { dyed };
        let label = (board_m / tall_m - 0.7).abs() < 0.08 && chance(8) > 0.4;
        let round = 1.0 - 0.45 * (2.0 * across - 1.0).abs().powi(4);
        (if label { Rgb::repeat(205.0) } else { cloth }) * round
    }

    fn photograph(&self, s: f64, t: f64) -> Rgb {
        let field = |k: u64| fractal(s / self.size_m, t / self.size_m, 4, self.seed ^ k);
        let (land, light) = (field(1), field(2));
        let base = if land > 0.0 { self.rgb } else { self.other };
        base * (1.0 + 0.5 * light) + Rgb::new(60.0 * field(3), 50.0 * field(4), 60.0 * field(5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_brick_wall_has_courses_and_mortar_where_they_belong() {
        let wall = Paint {
            kind: PaintKind::Brick,
            rgb: Rgb::new(160.0, 80.0, 60.0),
            other: Rgb::repeat(200.0),
            size_m: 0.08,
            seed: 4,
        };
        let (in_joint, in_brick) = (wall.at(0.12, 0.0), wall.at(0.12, 0.04));
        assert!((in_joint.y - in_joint.z).abs() < 1.0 && in_joint.x > 180.0);
        assert!(in_brick.x > 1.3 * in_brick.z);
        assert_eq!(wall.at(0.12, 0.04), wall.at(0.12, 0.04));
    }
}
