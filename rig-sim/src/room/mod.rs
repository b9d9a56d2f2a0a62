//! Rooms drawn from a seed: walls, furniture, lamps, the rope's look, and what else moves.
//!
//! A room is data. [`crate::render`] draws it, [`crate::room_film`] films a wiggle in it.

pub(crate) mod bystander;
mod furnish;
pub(crate) mod lamp;
pub(crate) mod paint;
mod palette;
mod picture;
mod rope_look;
pub(crate) mod shapes;
pub(crate) mod still;

pub use palette::Named;
pub use picture::Picture;
pub use rope_look::RopeSurface;

use crate::render::Appearance;
use arm_model::Cell;
use bystander::{Bystanders, Cable, Walker};
use furnish::WALLS;
use lamp::Lamp;
use nalgebra::Vector3;
use paint::Rgb;
use palette::one_of;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use still::Still;

/// Keeps the draw of rooms apart from other draws of the same seed.
const STREAM: u64 = 0x0072_6f6f_6d73;
/// Where the rope hangs, about its middle (m).
const ROPE_M: Vector3<f64> = Vector3::new(0.66, 0.0, -0.05);

/// How hard it is to see the rope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A room as people have it: a person sees the rope and its tip in every frame.
    Ordinary,
    /// A rope in the wall's colour, somebody who walks by, other ropes and cables, glare:
    /// one of them at least.
    Hard,
}

impl Kind {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Ordinary => "ordinary",
            Self::Hard => "hard",
        }
    }
}

/// A room.
#[derive(Debug, Clone, PartialEq)]
pub struct Room {
    /// How hard it is to see the rope in it.
    pub kind: Kind,
    /// The wall: plaster, brick, wood, shelf, posters, curtain or window.
    pub wall: &'static str,
    /// Shadows of moving things: faint, soft or sharp.
    pub shadows: &'static str,
    /// What makes a hard room hard.
    pub hardships: Vec<&'static str>,
    /// The rope's surface.
    pub rope: RopeSurface,
    /// What the camera adds.
    pub picture: Picture,
    pub(crate) still: Still,
    pub(crate) bystanders: Bystanders,
}

impl Room {
    /// The room of a seed.
    #[must_use]
    pub fn draw(seed: u64, kind: Kind) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ STREAM);
        rng.set_stream(kind as u64);
        let rng = &mut rng;
        let cell = Cell::default();
        let wall = one_of(rng, &WALLS);
        let wall_y_m = rng.random_range(0.50..1.50);
        let (shadows, lamps, ambient) = lamps(rng, wall_y_m);
        let wall_paint = furnish::wall(rng, wall);
        let mean = wall_paint.mean();
        let mut things = Vec::from(furnish::stand(rng, &cell));
        things.extend(furnish::hung(rng, wall_y_m, wall));
        things.extend(furnish::clutter(rng, cell.floor_z_m, wall_y_m));
        // The camera's automatic exposure, about right.
        let gain = (rng.random_range(85.0..150.0) / mean.sum() * 3.0).clamp(0.62, 1.12);
        let warm = rng.random_range(-0.08..0.14);
        let still = Still {
            wall_y_m,
            floor_z_m: cell.floor_z_m,
            wall: wall_paint,
            floor: furnish::floor(rng),
            things,
            lamps,
            ambient,
            tints: [
                Rgb::new(1.0 - 0.3 * warm, 1.0, 1.0 + 0.4 * warm),
                Rgb::new(1.0 + 0.5 * warm, 1.0, 1.0 - warm),
            ],
            gain,
        };
        let mut room = Self {
            kind,
            wall,
            shadows,
            hardships: Vec::new(),
            rope: rope_look::visible(rng, &mean, &still.floor.mean()),
            picture: Picture::draw(rng),
            still,
            bystanders: Bystanders::default(),
        };
        if wall == "window" {
            room.picture.glare = Some(glare(rng, wall_y_m, 0.35));
        }
        if kind == Kind::Hard {
            room.harden(rng, &mean);
        }
        room
    }

    /// The main colours of what is seen in it, with the target's.
    pub(crate) fn appearance(&self, target_rgb: [u8; 3]) -> Appearance {
        Appearance {
            rope_rgb: self.rope.rope.rgb,
            lead_rgb: self.rope.tip.rgb,
            target_rgb,
            wall_rgb: palette::bytes(&self.still.wall.mean()),
        }
    }

    /// Adds what makes it hard to see the rope.
    fn harden(&mut self, rng: &mut impl Rng, wall: &Rgb) {
        let first = rng.random_range(0..4);
        let chosen = |rng: &mut _, i| i == first || RngExt::random_bool(rng, 0.35);
        if chosen(rng, 0) {
            self.hardships.push("camouflage");
            self.rope = rope_look::hidden(rng, wall);
        }
        if chosen(rng, 1) {
            self.hardships.push("walker");
            let walker = Walker::draw(rng, self.still.floor_z_m, self.still.wall_y_m);
            self.bystanders.walkers.push(walker);
        }
        if chosen(rng, 2) {
            self.hardships.push("cables");
            for _ in 0..rng.random_range(1..4) {
                let cable = Cable::draw(rng, &self.rope.cord);
                self.bystanders.cables.push(cable);
            }
        }
        if chosen(rng, 3) {
            self.hardships.push("glare");
            self.picture.glare = Some(glare(rng, self.still.wall_y_m, 1.0));
        }
    }
}

/// Light scattered in the lens around a bright place on the wall.
fn glare(rng: &mut impl Rng, wall_y_m: f64, part: f32) -> (Vector3<f64>, f32, f32) {
    let at = Vector3::new(
        rng.random_range(0.1..1.4),
        wall_y_m,
        rng.random_range(-0.2..0.6),
    );
    let levels = part * rng.random_range(50.0..150.0);
    (at, levels, rng.random_range(60.0..160.0))
}

/// How sharp the shadows are, the lamps, and the light from everywhere.
fn lamps(rng: &mut impl Rng, wall_y_m: f64) -> (&'static str, Vec<Lamp>, f64) {
    let (name, parts, radii_m) = match rng.random_range(0..10) {
        0 | 1 => ("faint", 0.10..0.22, 0.15..0.40),
        2..6 => ("soft", 0.45..0.75, 0.08..0.25),
        _ => ("sharp", 0.45..0.80, 0.01..0.05),
    };
    let direct: f64 = rng.random_range(parts);
    let count = if rng.random_bool(0.35) { 2 } else { 1 };
    let lamps = (0..count)
        .map(|i| {
            // Where the rope's shadow falls on the wall; the lamp lies on the other side.
            let shadow_m = Vector3::new(
                ROPE_M.x + rng.random_range(-0.6..0.7),
                wall_y_m,
                ROPE_M.z - rng.random_range(0.0..0.45),
            );
            let way = (ROPE_M - shadow_m).normalize();
            let reach_m = rng.random_range(1.2..2.8);
            let at_m = ROPE_M + way * reach_m;
            let part = match (count, i) {
                (1, _) => 1.0,
                (_, 0) => 0.65,
                _ => 0.35,
            };
            Lamp {
                // Above the floor and not in the rope's way.
                at_m: Vector3::new(at_m.x, at_m.y.min(-0.5), at_m.z.max(0.35)),
                radius_m: rng.random_range(radii_m.clone()),
                power: direct * part,
                reach_m: (at_m - shadow_m).norm(),
            }
        })
        .collect();
    (name, lamps, 1.0 - direct)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_gives_the_same_room_again_and_seeds_and_kinds_differ() {
        for kind in [Kind::Ordinary, Kind::Hard] {
            for seed in 0..40 {
                let room = Room::draw(seed, kind);
                assert_eq!(room, Room::draw(seed, kind));
                assert_ne!(room, Room::draw(seed + 1, kind));
                assert_eq!(room.hardships.is_empty(), kind == Kind::Ordinary);
            }
        }
        assert_ne!(Room::draw(3, Kind::Ordinary), Room::draw(3, Kind::Hard));
    }

    #[test]
    fn a_rope_of_an_ordinary_room_stands_out_from_its_wall() {
        for seed in 0..200 {
            let room = Room::draw(seed, Kind::Ordinary);
            let wall = room.still.wall.mean();
            for named in [room.rope.rope, room.rope.tip] {
                let far = palette::apart(&Rgb::from(named.rgb.map(f64::from)), &wall);
                assert!(far > 35.0, "seed {seed}: {} is {far} off", named.name);
            }
        }
    }

    #[test]
    fn all_walls_and_shadows_are_drawn_and_most_lamps_stand_before_the_wall() {
        let rooms: Vec<_> = (0..120).map(|s| Room::draw(s, Kind::Ordinary)).collect();
        for wall in WALLS {
            assert!(rooms.iter().any(|r| r.wall == wall), "{wall}");
        }
        for shadows in ["faint", "soft", "sharp"] {
            assert!(rooms.iter().any(|r| r.shadows == shadows), "{shadows}");
        }
        for lamp in rooms.iter().flat_map(|r| &r.still.lamps) {
            assert!(lamp.at_m.y <= -0.5 && lamp.at_m.z > 0.3, "{lamp:?}");
        }
    }
}
