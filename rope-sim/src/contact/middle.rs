//! The point of a link that comes closest to a convex obstacle.

use super::body::Body;
use crate::algebra::Vec3;
use crate::lanes::Lanes;

/// Halvings of the link: a 128th of it is left, 0.2 mm.
const HALVINGS: usize = 6;
/// Closer to an end than this (parts of the link), the nodes' contacts do.
const END_PART: f64 = 0.04;

/// Where on the link from `near` to `far` the distance to the obstacle is least, as
/// part of the link from the far node back, and a number that is positive where that
/// is between the nodes. Distance to a convex body is convex along a line: the sign
/// of its slope tells on which side the minimum lies.
#[inline(always)]
pub(crate) fn closest<V: Lanes>(body: &Body<V>, near: Vec3<V>, far: Vec3<V>) -> (V, V) {
    let (zero, one) = (V::splat(0.0), V::splat(1.0));
    let way = near.sub(far);
    let (mut low, mut high) = (zero, one);
    for _ in 0..HALVINGS {
        let middle = (low + high) * V::splat(0.5);
        let (_, normal) = body.distance(way.scale_add(middle, far));
        let slope = normal.dot(way);
        low = V::select_less(slope, zero, middle, low);
        high = V::select_less(slope, zero, high, middle);
    }
    let back = (low + high) * V::splat(0.5);
    let inside = V::select_less(V::splat(END_PART), back.min(one - back), one, zero);
    (back, inside)
}
