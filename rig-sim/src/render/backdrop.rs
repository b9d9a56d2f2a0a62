//! The plain room behind the robot: plaster wall, floor, the column under the arm, a
//! cabinet and a whiteboard. Nothing in it moves, so it is cast once per eye.

use super::texture::{fractal, noise};
use crate::room::shapes::Shape;
use arm_model::Cell;
use nalgebra::Vector3;

/// Distance of the wall behind the arm's base (m).
const WALL_Y_M: f64 = 0.95;

/// Colour in video levels while light is still being added up.
type Rgb = Vector3<f64>;

/// An upright box standing in the room.
struct Cuboid {
    shape: Shape,
    /// Its colour at a point, on a face with this normal, so high above the floor (m).
    paint: fn(&Vector3<f64>, &Vector3<f64>, f64) -> Rgb,
}

/// What stands in the room.
fn furniture(cell: &Cell) -> [Cuboid; 4] {
    let (half, floor_z_m) = (cell.column_half_width_m, cell.floor_z_m);
    let cuboid = |low_m: [f64; 3], high_m: [f64; 3], paint| Cuboid {
        shape: Shape::Box {
            low_m: low_m.into(),
            high_m: high_m.into(),
        },
        paint,
    };
    [
        cuboid([-half, -half, floor_z_m], [half, half, 0.0], column),
        cuboid(
            [-0.17, -0.17, floor_z_m],
            [0.17, 0.17, floor_z_m + 0.015],
            plate,
        ),
        cuboid(
            [-1.32, 0.50, floor_z_m + 0.06],
            [-0.42, WALL_Y_M, 0.02],
            cabinet,
        ),
        cuboid(
            [1.52, WALL_Y_M - 0.018, 0.10],
            [2.62, WALL_Y_M, 0.86],
            whiteboard,
        ),
    ]
}

/// Light on a face with this normal: a broad lamp above and left of the camera.
fn light(normal: &Vector3<f64>) -> f64 {
    const LAMP: Vector3<f64> = Vector3::new(-0.40, -0.62, 0.68);
    0.55 + 0.50 * normal.dot(&LAMP).max(0.0)
}

/// Slotted aluminium profile.
fn column(p: &Vector3<f64>, normal: &Vector3<f64>, above_floor_m: f64) -> Rgb {
    if normal.z > 0.5 {
        return Rgb::repeat(150.0);
    }
    let across = if normal.x.abs() > 0.5 { p.y } else { p.x };
    let slot = ((across / 0.045).fract().abs() - 0.5).abs() < 0.09;
    let brushed = 1.0 + 0.05 * noise(across * 900.0, p.z * 6.0, 3);
    let ramp = 1.0 + 0.06 * above_floor_m;
    Rgb::new(168.0, 171.0, 175.0) * (brushed * ramp * light(normal) * if slot { 0.55 } else { 1.0 })
}

fn plate(p: &Vector3<f64>, normal: &Vector3<f64>, _: f64) -> Rgb {
    Rgb::new(74.0, 76.0, 80.0) * (light(normal) * (1.0 + 0.06 * noise(p.x * 60.0, p.y * 60.0, 9)))
}

/// Grey laminate with two doors and handles.
fn cabinet(p: &Vector3<f64>, normal: &Vector3<f64>, _: f64) -> Rgb {
    let grain = 1.0 + 0.04 * fractal(p.x * 5.0, p.z * 60.0, 3, 21);
    if normal.z > 0.5 {
        return Rgb::new(150.0, 138.0, 122.0) * (grain * light(normal));
    }
    let door = (p.x + 0.87).abs();
    let gap = door < 0.003 || p.z > -0.012 && p.z < -0.006;
    let handle = (door - 0.05).abs() < 0.006 && (p.z + 0.16).abs() < 0.07;
    let base = if handle {
        Rgb::new(92.0, 94.0, 96.0)
    } else {
        Rgb::new(158.0, 154.0, 147.0)
    };
    base * (grain * light(normal) * if gap { 0.45 } else { 1.0 })
}

/// A whiteboard in an aluminium frame, wiped but not clean.
fn whiteboard(p: &Vector3<f64>, normal: &Vector3<f64>, _: f64) -> Rgb {
    let edge = (p.x - 1.52).min(2.62 - p.x).min(p.z - 0.10).min(0.86 - p.z);
    if edge < 0.018 {
        return Rgb::new(140.0, 143.0, 147.0) * light(normal);
    }
    let smear = 3.0 * fractal(p.x * 3.0 + p.z * 2.0, p.z * 9.0, 3, 31);
    (Rgb::new(214.0, 217.0, 218.0) + Rgb::repeat(smear)) * light(normal)
}

/// The room of a cell, with its wall colour.
pub(super) struct PlainRoom {
    wall_rgb: Rgb,
    floor_z_m: f64,
    furniture: [Cuboid; 4],
}

impl PlainRoom {
    pub(super) fn new(wall_rgb: [u8; 3], cell: &Cell) -> Self {
        Self {
            wall_rgb: Rgb::from(wall_rgb.map(f64::from)),
            floor_z_m: cell.floor_z_m,
            furniture: furniture(cell),
        }
    }

    fn wall(&self, p: &Vector3<f64>) -> Rgb {
        if p.z < self.floor_z_m + 0.08 {
            let top = p.z > self.floor_z_m + 0.072;
            return Rgb::repeat(if top { 205.0 } else { 186.0 });
        }
        let rough = 0.035 * fractal(p.x * 45.0, p.z * 45.0, 3, 1);
        let stains = 0.045 * fractal(p.x * 1.7, p.z * 1.7, 3, 5);
        // Light falls off from the lamp at the upper left.
        let falloff = 0.085 * ((p.x + 0.4).hypot(p.z - 0.9) - 0.9);
        let corner = 0.10 * (-(p.z - self.floor_z_m) / 0.18).exp();
        self.wall_rgb * (1.13 + rough + stains - falloff - corner)
    }

    fn floor(p: &Vector3<f64>) -> Rgb {
        let (x, y) = (p.x / 0.5, p.y / 0.5);
        let joint = x.rem_euclid(1.0).min(y.rem_euclid(1.0)) < 0.008;
        let speckle = 0.09 * noise(p.x * 260.0, p.y * 260.0, 11)
            + 0.05 * fractal(p.x * 4.0, p.y * 4.0, 3, 13);
        let reach = (p.x.abs().max(p.y.abs()) - 0.17).max(0.0);
        let shadow = 0.42 * (-reach / 0.14).exp() + 0.35 * (-(WALL_Y_M - p.y) / 0.12).exp();
        Rgb::new(128.0, 130.0, 132.0)
            * ((1.0 + speckle) * (1.0 - shadow) * if joint { 0.7 } else { 1.0 })
    }

    /// Colour where a ray ends.
    pub(super) fn look(&self, origin: &Vector3<f64>, ray: &Vector3<f64>) -> Rgb {
        let nearest = self
            .furniture
            .iter()
            .filter_map(|c| Some((c.shape.hit(origin, ray)?, c.paint)))
            .min_by(|a, b| a.0.t.total_cmp(&b.0.t));
        if let Some((hit, paint)) = nearest {
            let p = origin + ray * hit.t;
            return paint(&p, &hit.normal, p.z - self.floor_z_m);
        }
        let to_floor = (self.floor_z_m - origin.z) / ray.z;
        let to_wall = (WALL_Y_M - origin.y) / ray.y;
        if to_floor > 0.0 && !(to_wall > 0.0 && to_wall < to_floor) {
            Self::floor(&(origin + ray * to_floor))
        } else if to_wall > 0.0 {
            self.wall(&(origin + ray * to_wall))
        } else {
            Rgb::repeat(90.0)
        }
    }
}
