//! Colours of ropes and rooms, by name.

use super::paint::Rgb;
use crate::render::colour::ycc;
use rand::{Rng, RngExt};

/// A colour with its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Named {
    /// What people call it.
    pub name: &'static str,
    /// 8-bit video RGB.
    pub rgb: [u8; 3],
}

const fn named(name: &'static str, rgb: [u8; 3]) -> Named {
    Named { name, rgb }
}

/// Ropes and tip weights.
pub(crate) const ROPES: [Named; 13] = [
    named("white", [232, 230, 224]),
    named("hemp", [198, 166, 114]),
    named("red", [188, 34, 36]),
    named("orange", [228, 108, 28]),
    named("yellow", [234, 202, 42]),
    named("green", [36, 140, 62]),
    named("blue", [38, 74, 192]),
    named("purple", [112, 52, 160]),
    named("pink", [230, 96, 162]),
    named("brown", [112, 72, 44]),
    named("black", [36, 36, 38]),
    named("grey", [142, 143, 146]),
    named("teal", [28, 142, 148]),
];

/// Painted walls, from pale to dark.
pub(crate) const PLASTER: [[u8; 3]; 10] = [
    [206, 205, 200],
    [192, 182, 164],
    [170, 180, 190],
    [158, 170, 148],
    [190, 160, 140],
    [136, 142, 150],
    [112, 126, 112],
    [96, 100, 116],
    [150, 110, 96],
    [70, 74, 84],
];
/// Bricks.
pub(crate) const BRICK: [[u8; 3]; 4] = [
    [158, 84, 62],
    [178, 142, 112],
    [134, 70, 58],
    [150, 134, 120],
];
/// Timber.
pub(crate) const WOOD: [[u8; 3]; 5] = [
    [206, 168, 112],
    [170, 124, 78],
    [120, 84, 54],
    [88, 66, 48],
    [190, 176, 150],
];
/// Cloth and painted things.
pub(crate) const CLOTH: [[u8; 3]; 12] = [
    [128, 58, 56],
    [62, 80, 112],
    [82, 106, 84],
    [186, 178, 166],
    [96, 94, 98],
    [164, 138, 88],
    [104, 76, 100],
    [48, 52, 58],
    [166, 116, 88],
    [130, 134, 138],
    [206, 202, 194],
    [72, 66, 60],
];

/// One of several.
pub(crate) fn one_of<T: Copy>(rng: &mut impl Rng, of: &[T]) -> T {
    of[rng.random_range(0..of.len())]
}

/// A colour as numbers, each a little off by chance.
pub(crate) fn about(rng: &mut impl Rng, rgb: [u8; 3], spread: f64) -> Rgb {
    Rgb::from(rgb.map(f64::from))
        .map(|c| (c + rng.random_range(-spread..=spread)).clamp(8.0, 245.0))
}

/// How far apart two colours look: in hue more than in brightness.
pub(crate) fn apart(a: &Rgb, b: &Rgb) -> f64 {
    let code = |c: &Rgb| ycc([c.x, c.y, c.z].map(|v| v as f32)).map(f64::from);
    let (a, b) = (code(a), code(b));
    let hue = (a[1] - b[1]).hypot(a[2] - b[2]);
    (0.6 * (a[0] - b[0])).hypot(1.6 * hue)
}

/// A colour as 8-bit video RGB.
pub(crate) fn bytes(rgb: &Rgb) -> [u8; 3] {
    [rgb.x, rgb.y, rgb.z].map(|c| c.round().clamp(0.0, 255.0) as u8)
}
