//! An obstacle as the lanes see it: shape, and its frame at the end of the step.

use super::shape;
use crate::algebra::Vec3;
use crate::lanes::Lanes;
use crate::scene::{Obstacle, Shape};
use nalgebra::{Isometry3, Vector3};

/// A rigid frame that moves, one per lane. Positions are relative to the clock's
/// origin.
#[derive(Clone, Copy)]
pub(crate) struct Frame<V> {
    pub(crate) p: Vec3<V>,
    pub(crate) axes: [Vec3<V>; 3],
    pub(crate) v: Vec3<V>,
    pub(crate) w: Vec3<V>,
}

impl<V: Lanes> Frame<V> {
    #[inline(always)]
    fn fixed(pose: &Isometry3<f64>, origin_m: [f64; 3]) -> Self {
        let p = pose.translation.vector - Vector3::from(origin_m);
        Self {
            p: constant(&p),
            axes: axes_of(pose),
            v: Vec3::zero(),
            w: Vec3::zero(),
        }
    }

    #[inline(always)]
    fn to_local(self, x: Vec3<V>) -> Vec3<V> {
        let d = x.sub(self.p);
        let [a, b, c] = self.axes;
        Vec3(a.dot(d), b.dot(d), c.dot(d))
    }

    #[inline(always)]
    fn to_world(self, v: Vec3<V>) -> Vec3<V> {
        let [a, b, c] = self.axes;
        a.scale_add(v.0, b.scale_add(v.1, c.scale(v.2)))
    }

    /// Velocity of the point of the frame that is at `x` (m/s).
    #[inline(always)]
    pub(crate) fn velocity_at(&self, x: Vec3<V>) -> Vec3<V> {
        self.w.cross_add(x.sub(self.p), self.v)
    }
}

/// Directions of a frame's axes, in all lanes.
#[inline(always)]
fn axes_of<V: Lanes>(pose: &Isometry3<f64>) -> [Vec3<V>; 3] {
    let r = pose.rotation.to_rotation_matrix();
    let m = r.matrix();
    [
        constant(&m.column(0).into()),
        constant(&m.column(1).into()),
        constant(&m.column(2).into()),
    ]
}

/// A number triple in all lanes.
#[inline(always)]
pub(crate) fn constant<V: Lanes>(v: &Vector3<f64>) -> Vec3<V> {
    Vec3::splat(v.x, v.y, v.z)
}

/// One obstacle.
#[derive(Clone)]
pub(crate) struct Body<V> {
    pub(crate) shape: Shape,
    pub(crate) friction: V,
    pub(crate) frame: Frame<V>,
    /// Whether it is the domino, which yields.
    pub(crate) rocks: bool,
}

impl<V: Lanes> Body<V> {
    #[inline(always)]
    pub(crate) fn new(obstacle: &Obstacle, origin_m: [f64; 3]) -> Self {
        Self {
            shape: obstacle.shape,
            friction: V::splat(obstacle.friction),
            frame: Frame::fixed(&obstacle.pose, origin_m),
            rocks: false,
        }
    }

    /// Distance (m) of the world point `x` to the surface, and its gradient.
    #[inline(always)]
    pub(crate) fn distance(&self, x: Vec3<V>) -> (V, Vec3<V>) {
        let (d, n) = shape::distance(&self.shape, self.frame.to_local(x));
        (d, self.frame.to_world(n))
    }
}
