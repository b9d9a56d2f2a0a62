//! Signed distance from a point to a convex shape, and its direction.
//!
//! Positive outside. The gradient is the outward normal of the nearest surface point;
//! inside, of the nearest face. Distances are exact outside.

use crate::algebra::Vec3;
use crate::lanes::Lanes;
use crate::scene::Shape;

/// Lengths below which a direction has no meaning (m).
const NO_LENGTH_M: f64 = 1e-9;

/// Distance (m) and its gradient at `p`, in the shape's frame.
#[inline(always)]
pub(crate) fn distance<V: Lanes>(shape: &Shape, p: Vec3<V>) -> (V, Vec3<V>) {
    match *shape {
        Shape::HalfSpace => (p.2, Vec3::splat(0.0, 0.0, 1.0)),
        Shape::Box { half_m } => {
            let [x, y, z] = half_m;
            to_box([V::splat(x), V::splat(y), V::splat(z)], p)
        }
        Shape::Cylinder {
            half_length_m,
            radius_m,
        } => {
            let zero = V::splat(0.0);
            let (rho, outward) = direction(Vec3(p.0, p.1, zero), Vec3::splat(1.0, 0.0, 0.0));
            // The meridian is a rectangle.
            let half = [V::splat(radius_m), V::splat(half_length_m), V::splat(1.0)];
            let (d, n) = to_box(half, Vec3(rho, p.2, zero));
            (d, Vec3(outward.0 * n.0, outward.1 * n.0, n.1))
        }
    }
}

/// Length of a vector and its direction; `otherwise` where it is too short.
#[inline(always)]
fn direction<V: Lanes>(v: Vec3<V>, otherwise: Vec3<V>) -> (V, Vec3<V>) {
    let least = V::splat(NO_LENGTH_M);
    let length = v.norm();
    let unit = v.scale(length.max(least).recip());
    (length, Vec3::select_less(least, length, unit, otherwise))
}

#[inline(always)]
fn to_box<V: Lanes>(half: [V; 3], p: Vec3<V>) -> (V, Vec3<V>) {
    let zero = V::splat(0.0);
    let one = V::splat(1.0);
    let q = [
        p.0.abs() - half[0],
        p.1.abs() - half[1],
        p.2.abs() - half[2],
    ];
    let beyond = Vec3(q[0].max(zero), q[1].max(zero), q[2].max(zero));
    let largest = q[0].max(q[1]).max(q[2]);
    // Nearest face, for points inside or on the surface.
    let on_x = V::select_less(q[0], largest, zero, one);
    let on_y = V::select_less(q[1], largest, zero, one - on_x);
    let on_z = (one - on_x) - on_y;
    let (outside, n) = direction(beyond, Vec3(on_x, on_y, on_z));
    let signed = Vec3(n.0.flip_by(p.0), n.1.flip_by(p.1), n.2.flip_by(p.2));
    (outside + largest.min(zero), signed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn at(shape: Shape, p: [f64; 3]) -> (f64, Vector3<f64>) {
        let (d, n) = distance(&shape, Vec3(p[0], p[1], p[2]));
        (d, Vector3::new(n.0, n.1, n.2))
    }

    const BOX: Shape = Shape::Box {
        half_m: [0.1, 0.2, 0.3],
    };
    const CYLINDER: Shape = Shape::Cylinder {
        half_length_m: 0.3,
        radius_m: 0.1,
    };

    #[test]
    fn distances_known_by_hand() {
        for (shape, p, d) in [
            (BOX, [0.15, 0.0, 0.0], 0.05),
            (BOX, [0.13, -0.24, 0.0], 0.05),
            (BOX, [0.09, 0.1, -0.1], -0.01),
            (CYLINDER, [0.0, 0.3, 0.0], 0.2),
            (CYLINDER, [0.0, 0.13, 0.34], 0.05),
            (CYLINDER, [0.0, 0.02, -0.29], -0.01),
            (Shape::HalfSpace, [4.0, 5.0, -0.2], -0.2),
        ] {
            assert!((at(shape, p).0 - d).abs() < 1e-12, "{shape:?} {p:?}");
        }
    }

    /// Following the gradient by the distance leads to the surface, and the gradient
    /// is that of the distance.
    #[test]
    fn gradients_lead_to_the_surface() {
        for i in 0..500 {
            let t = f64::from(i);
            let p = Vector3::new((t * 1.7).sin(), (t * 0.9).cos(), (t * 2.3).sin()) * 0.45;
            for shape in [BOX, CYLINDER] {
                let (d, n) = at(shape, p.into());
                assert!((n.norm() - 1.0).abs() < 1e-12);
                let foot = p - n * d;
                assert!(at(shape, foot.into()).0.abs() < 1e-9, "{shape:?} {p}");
                let ahead = at(shape, (p + n * 1e-6).into()).0;
                assert!((ahead - d - 1e-6).abs() < 1e-9);
            }
        }
    }
}
