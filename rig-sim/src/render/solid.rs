//! Capsules in the world, before an eye or a lamp sees them.

use super::colour::{Ycc, ycc};
use super::weave::Weave;
use nalgebra::Vector3;

/// How a surface answers the light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Material {
    /// Colour when lit squarely.
    pub(crate) colour: Ycc,
    /// Luma of the highlight.
    pub(crate) gloss: f32,
    pub(crate) weave: Weave,
}

impl Material {
    /// One colour (8-bit video RGB).
    pub(crate) fn plain(rgb: [u8; 3], gloss: f32) -> Self {
        Self {
            colour: ycc(rgb.map(f32::from)),
            gloss,
            weave: Weave::Plain,
        }
    }
}

/// A capsule: all points within a radius of a segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Solid {
    /// Both ends of the segment (world, m).
    pub(crate) a_m: Vector3<f64>,
    pub(crate) b_m: Vector3<f64>,
    pub(crate) radius_m: f64,
    pub(crate) material: Material,
    /// Length of what continues from it at both ends (m), where its pattern goes on.
    pub(crate) arc_m: [f64; 2],
}

impl Solid {
    /// A capsule whose pattern begins with it.
    pub(crate) fn new(
        a_m: &Vector3<f64>,
        b_m: &Vector3<f64>,
        radius_m: f64,
        material: Material,
    ) -> Self {
        Self {
            a_m: *a_m,
            b_m: *b_m,
            radius_m,
            material,
            arc_m: [0.0, (b_m - a_m).norm()],
        }
    }

    /// Capsules along a line, with one pattern.
    pub(crate) fn chain(
        line: &[Vector3<f64>],
        radius_m: f64,
        material: Material,
    ) -> impl Iterator<Item = Self> {
        let mut arc_m = 0.0;
        line.windows(2).map(move |p| {
            let piece = Self::new(&p[0], &p[1], radius_m, material);
            let from_m = arc_m;
            arc_m += piece.arc_m[1];
            Self {
                arc_m: [from_m, arc_m],
                ..piece
            }
        })
    }
}
