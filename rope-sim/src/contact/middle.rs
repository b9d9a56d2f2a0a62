//! The point of a link that comes closest to a convex obstacle.

use super::body::Body;
use crate::algebra::Vec3;
use crate::lanes::Lanes;

/// Halvings of the link: a 64th of it is left, 0.4 mm.
const HALVINGS: usize = 6;
/// Closer to an end than this (parts of the link), the nodes' contacts do.
const END_PART: f64 = 0.04;

/// Where on the link from `near` to `far` the distance to the obstacle is least, as
/// part of the link from the far node back, and a number that is positive where that
/// is between the nodes; nothing where it is so in no lane. Distance to a convex body
/// is convex along a line: the sign of its slope tells on which side the minimum lies.
#[inline(always)]
pub(crate) fn closest<V: Lanes>(body: &Body<V>, near: Vec3<V>, far: Vec3<V>) -> Option<(V, V)> {
    let (zero, one) = (V::splat(0.0), V::splat(1.0));
    let way = near.sub(far);
    let (mut low, mut high) = (V::splat(END_PART), V::splat(1.0 - END_PART));
    let falls = V::select_less(slope(body, way, far, low), zero, one, zero);
    let inside = V::select_less(zero, slope(body, way, far, high), falls, zero);
    if !V::any_less(zero, inside) {
        return None;
    }
    for _ in 0..HALVINGS {
        let middle = (low + high) * V::splat(0.5);
        let slope = slope(body, way, far, middle);
        low = V::select_less(slope, zero, middle, low);
        high = V::select_less(slope, zero, high, middle);
    }
    Some(((low + high) * V::splat(0.5), inside))
}

/// Change of the distance on the way from the far node, `back` of it done.
#[inline(always)]
fn slope<V: Lanes>(body: &Body<V>, way: Vec3<V>, far: Vec3<V>, back: V) -> V {
    let (_, normal) = body.distance(way.scale_add(back, far));
    normal.dot(way)
}
