//! What stands in a room and hangs on its wall, drawn by chance.

use super::paint::{Paint, PaintKind, Rgb};
use super::palette::{BRICK, CLOTH, PLASTER, WOOD, about, one_of};
use super::shapes::{Shape, Thing};
use arm_model::Cell;
use nalgebra::Vector3;
use rand::{Rng, RngExt};

/// Walls by name.
pub(crate) const WALLS: [&str; 7] = [
    "plaster", "brick", "wood", "shelf", "posters", "curtain", "window",
];

/// The wall's surface.
pub(crate) fn wall(rng: &mut impl Rng, name: &str) -> Paint {
    let seed: u64 = rng.random();
    let chance = |i: u64| ((seed >> (8 * i)) & 255) as usize;
    let part = chance(1) as f64 / 255.0;
    let (kind, colours, other, size_m) = match name {
        "brick" => {
            let mortar = [186, 182, 174];
            (PaintKind::Brick, &BRICK[..], mortar, 0.06 + 0.04 * part)
        }
        "wood" => (PaintKind::Boards, &WOOD[..], [0; 3], 0.09 + 0.14 * part),
        "shelf" => (PaintKind::Books, &WOOD[..], [0; 3], 0.28 + 0.10 * part),
        "curtain" => (PaintKind::Curtain, &CLOTH[..], [0; 3], 0.07 + 0.10 * part),
        _ => (PaintKind::Plaster, &PLASTER[..], [0; 3], 1.0),
    };
    Paint {
        kind,
        rgb: about(rng, colours[chance(0) % colours.len()], 12.0),
        other: about(rng, other, 12.0),
        size_m,
        seed,
    }
}

/// The floor's surface.
pub(crate) fn floor(rng: &mut impl Rng) -> Paint {
    let (kind, rgb, size_m) = match rng.random_range(0..3) {
        0 => (PaintKind::Boards, one_of(rng, &WOOD), 0.14),
        1 => (PaintKind::Tiles, [134, 134, 132], 0.4),
        _ => (PaintKind::Carpet, one_of(rng, &CLOTH), 1.0),
    };
    Paint {
        kind,
        rgb: about(rng, rgb, 12.0) * 0.85,
        other: Rgb::zeros(),
        size_m,
        seed: rng.random(),
    }
}

/// A surface of what people put into rooms.
fn surface(rng: &mut impl Rng, kinds: &[PaintKind]) -> Paint {
    let of_wood = rng.random_bool(0.35);
    let rgb = if of_wood {
        one_of(rng, &WOOD)
    } else {
        one_of(rng, &CLOTH)
    };
    Paint {
        kind: one_of(rng, kinds),
        rgb: about(rng, rgb, 20.0),
        other: about(rng, [214, 210, 198], 30.0),
        size_m: rng.random_range(0.03..0.12),
        seed: rng.random(),
    }
}

/// Pictures and patterns on the wall.
pub(crate) fn hung(rng: &mut impl Rng, wall_y_m: f64, name: &str) -> Vec<Thing> {
    const PICTURES: [PaintKind; 6] = [
        PaintKind::Stripes,
        PaintKind::Checks,
        PaintKind::Dots,
        PaintKind::Photograph,
        PaintKind::Writing,
        PaintKind::Photograph,
    ];
    let mut things = Vec::new();
    let count = match name {
        "posters" => rng.random_range(6..12),
        "shelf" | "curtain" => 0,
        _ => rng.random_range(1..5),
    };
    for _ in 0..count {
        let (x, z) = (rng.random_range(-0.5..1.6), rng.random_range(-0.5..0.7));
        let (w, h) = (rng.random_range(0.12..0.55), rng.random_range(0.12..0.55));
        // Each hangs a little further out than those before it.
        let out_m = 0.004 + 0.002 * things.len() as f64;
        let mut paint = surface(rng, &PICTURES);
        if paint.kind == PaintKind::Writing {
            (paint.rgb, paint.other) = (Rgb::new(216.0, 214.0, 206.0), Rgb::repeat(48.0));
            paint.size_m = 0.022;
        }
        things.push(upright(wall_y_m, [x, z], [w, h], out_m, paint));
    }
    if name == "window" {
        let (x, z) = (rng.random_range(0.1..1.0), rng.random_range(-0.3..0.2));
        let (w, h) = (rng.random_range(0.6..1.2), rng.random_range(0.6..1.0));
        let paint = Paint {
            kind: PaintKind::Window,
            rgb: about(rng, [228, 234, 240], 14.0),
            other: about(rng, [150, 146, 140], 40.0),
            size_m: rng.random_range(0.25..0.5),
            seed: rng.random(),
        };
        things.push(upright(wall_y_m, [x, z], [w, h], 0.03, paint));
    }
    things
}

/// A flat thing on the wall.
fn upright(wall_y_m: f64, [x, z]: [f64; 2], [w, h]: [f64; 2], out_m: f64, paint: Paint) -> Thing {
    Thing {
        shape: Shape::Box {
            low_m: Vector3::new(x, wall_y_m - out_m, z),
            high_m: Vector3::new(x + w, wall_y_m + 0.01, z + h),
        },
        paint,
    }
}

/// The column under the arm, and its plate on the floor.
pub(crate) fn stand(rng: &mut impl Rng, cell: &Cell) -> [Thing; 2] {
    let steel = |rng: &mut _, rgb| Paint {
        kind: PaintKind::Laminate,
        rgb: about(rng, rgb, 14.0),
        other: Rgb::zeros(),
        size_m: 1.0,
        seed: 3,
    };
    let upright_box = |half: f64, low_z: f64, high_z: f64, paint| Thing {
        shape: Shape::Box {
            low_m: Vector3::new(-half, -half, low_z),
            high_m: Vector3::new(half, half, high_z),
        },
        paint,
    };
    let floor_z_m = cell.floor_z_m;
    let grey = rng.random_range(70..=180);
    [
        upright_box(
            cell.column_half_width_m,
            floor_z_m,
            0.0,
            steel(rng, [grey, grey, grey]),
        ),
        upright_box(0.17, floor_z_m, floor_z_m + 0.015, steel(rng, [74, 76, 80])),
    ]
}

/// Boxes, bins and tables with things on them, between rope and wall.
pub(crate) fn clutter(rng: &mut impl Rng, floor_z_m: f64, wall_y_m: f64) -> Vec<Thing> {
    const SURFACES: [PaintKind; 7] = [
        PaintKind::Laminate,
        PaintKind::Laminate,
        PaintKind::Boards,
        PaintKind::Carpet,
        PaintKind::Stripes,
        PaintKind::Checks,
        PaintKind::Writing,
    ];
    let mut things = Vec::new();
    for _ in 0..rng.random_range(2..8) {
        let x = rng.random_range(-0.5..1.9);
        let y = rng.random_range(0.28..(wall_y_m - 0.12).max(0.30));
        let height_m = rng.random_range(0.10..0.85);
        let half_m = rng.random_range(0.03..0.16);
        let foot = Vector3::new(x, y, floor_z_m);
        let paint = surface(rng, &SURFACES);
        let shape = if rng.random_bool(0.35) {
            Shape::Cylinder {
                foot_m: foot,
                radius_m: half_m,
                height_m,
            }
        } else {
            let across = Vector3::new(half_m * rng.random_range(0.7..2.0), half_m, 0.0);
            Shape::Box {
                low_m: foot - across,
                high_m: foot + across + Vector3::z() * height_m,
            }
        };
        things.push(Thing { shape, paint });
        if rng.random_bool(0.4) {
            let on = foot + Vector3::z() * height_m;
            let paint = surface(rng, &SURFACES);
            let shape = Shape::Cylinder {
                foot_m: on,
                radius_m: half_m * rng.random_range(0.2..0.6),
                height_m: rng.random_range(0.06..0.25),
            };
            things.push(Thing { shape, paint });
        }
    }
    things
}
