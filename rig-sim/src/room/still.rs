//! What never moves in a room, and the colour of what a ray meets.

use super::lamp::{LAMPS, Lamp, level, shoulder};
use super::paint::{Paint, Rgb};
use super::shapes::{Hit, Thing};
use nalgebra::Vector3;

/// Places of a lamp that a ray looks at.
const LOOKS: u32 = 3;
/// How far a shadow's ray starts from the surface (m).
const LIFT_M: f64 = 1e-4;

/// Wall, floor, furniture and lamps.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Still {
    /// The wall's place behind the arm (y, m).
    pub(crate) wall_y_m: f64,
    /// The floor's height (m).
    pub(crate) floor_z_m: f64,
    pub(crate) wall: Paint,
    pub(crate) floor: Paint,
    pub(crate) things: Vec<Thing>,
    pub(crate) lamps: Vec<Lamp>,
    /// Light from everywhere, as a part of all light.
    pub(crate) ambient: f64,
    /// Colours of the light from everywhere and from the lamps.
    pub(crate) tints: [Rgb; 2],
    /// Brightness of the picture.
    pub(crate) gain: f64,
}

/// What a ray meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Look {
    /// Its colour with all lamps that reach it.
    pub(crate) rgb: Rgb,
    /// Where it is (m).
    pub(crate) at_m: Vector3<f64>,
    /// Each lamp's part of the light there.
    pub(crate) shares: [f64; LAMPS],
}

impl Still {
    /// What a ray meets; `chance` (0 to 1 each) chooses the place on round lamps that a
    /// surface looks at.
    pub(crate) fn look(&self, origin: &Vector3<f64>, ray: &Vector3<f64>, chance: [f64; 2]) -> Look {
        let Some((hit, paint)) = self.meet(origin, ray) else {
            return Look {
                rgb: Rgb::repeat(60.0 * self.gain),
                at_m: origin + ray * 1e3,
                shares: [0.0; LAMPS],
            };
        };
        let at_m = origin + ray * hit.t;
        let [s, t] = hit.place;
        let own = paint.at(s, t);
        let mut shares = [0.0; LAMPS];
        if paint.glows(s, t) {
            let rgb = own;
            return Look { rgb, at_m, shares };
        }
        let lifted = at_m + hit.normal * LIFT_M;
        for (share, lamp) in shares.iter_mut().zip(&self.lamps) {
            let light = lamp.light(&at_m, &hit.normal);
            if light > 0.0 {
                let free = (0..LOOKS).filter(|i| {
                    // Golden parts spread a few places well.
                    let part = |k: f64, c: f64| (c + f64::from(*i) * k).fract();
                    let place = [part(0.382, chance[0]), part(0.618, chance[1])];
                    !self.is_between(&lifted, &lamp.place(&lifted, place))
                });
                *share = light * free.count() as f64 / f64::from(LOOKS);
            }
        }
        let ambient = self.ambient * self.openness(&at_m, &hit.normal);
        let direct: f64 = shares.iter().sum();
        let all = ambient + direct;
        let tint = (self.tints[0] * ambient + self.tints[1] * direct) / all.max(1e-9);
        let rgb = own.component_mul(&tint) * (level(all) * self.gain);
        let rgb = rgb.map(shoulder);
        Look {
            rgb,
            at_m,
            shares: shares.map(|s| s / all.max(1e-9)),
        }
    }

    /// How much of the light from everywhere reaches a place: less near corners.
    fn openness(&self, p: &Vector3<f64>, normal: &Vector3<f64>) -> f64 {
        let near = |distance_m: f64| 1.0 - 0.45 * (-distance_m / 0.12).exp();
        let above = if normal.z > 0.5 {
            1.0
        } else {
            near(p.z - self.floor_z_m)
        };
        let before = if normal.y < -0.5 {
            1.0
        } else {
            near(self.wall_y_m - p.y)
        };
        above * before
    }

    /// Where a ray meets the nearest surface, and that surface.
    fn meet(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> Option<(Hit, &Paint)> {
        let things = self.things.iter();
        let things = things.filter_map(|t| Some((t.shape.hit(origin, ray)?, &t.paint)));
        let plane = |t: f64, normal: Vector3<f64>, paint, place: fn(&Vector3<f64>) -> [f64; 2]| {
            let place = place(&(origin + ray * t));
            (t > 0.0).then_some((Hit { t, normal, place }, paint))
        };
        let to_wall = (self.wall_y_m - origin.y) / ray.y;
        let to_floor = (self.floor_z_m - origin.z) / ray.z;
        let wall = plane(to_wall, -Vector3::y(), &self.wall, |p| [p.x, p.z]);
        let floor = plane(to_floor, Vector3::z(), &self.floor, |p| [p.x, p.y]);
        things
            .chain(wall)
            .chain(floor)
            .min_by(|a, b| a.0.t.total_cmp(&b.0.t))
    }

    fn is_between(&self, from: &Vector3<f64>, to: &Vector3<f64>) -> bool {
        let way = to - from;
        let blocks = |thing: &Thing| thing.shape.hit(from, &way).is_some_and(|hit| hit.t < 1.0);
        self.things.iter().any(blocks)
    }
}
