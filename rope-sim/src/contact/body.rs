//! An obstacle as the lanes see it: shape, and its frame at the end of the step.

use super::shape;
use crate::algebra::{Quat, Vec3};
use crate::clock::BaseState;
use crate::lanes::Lanes;
use crate::scene::{Obstacle, Placement, Shape};
use nalgebra::{Isometry3, Point3, Vector3};
use shared_types::RopeParams;

/// Parts of the straight rope closer than this to what holds it belong to the
/// mounting (m).
const MOUNTING_GAP_M: f64 = 1e-3;

/// What carries an obstacle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Carrier {
    World,
    Attach,
    /// Index into the arm links the scene uses.
    ArmLink(usize),
    Domino,
}

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

    /// The frame at `local` in the carrier's frame.
    #[inline(always)]
    fn carried(carrier: &BaseState<V>, local: &Isometry3<f64>) -> Self {
        let q: Quat<V> = carrier.dynamics.q;
        let [x, y, z] = axes_of(local);
        let arm = q.turn(constant(&local.translation.vector));
        let w = carrier.dynamics.w;
        Self {
            p: carrier.position.add(arm),
            axes: [q.turn(x), q.turn(y), q.turn(z)],
            v: w.cross_add(arm, carrier.velocity),
            w,
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
pub(crate) struct Body<V> {
    pub(crate) shape: Shape,
    pub(crate) friction: V,
    pub(crate) carrier: Carrier,
    local: Isometry3<f64>,
    pub(crate) frame: Frame<V>,
    /// First link whose middle, and whose farther node, may touch; links before it
    /// belong to the mounting.
    pub(crate) first_middle: V,
    pub(crate) first_node: V,
}

impl<V: Lanes> Body<V> {
    #[inline(always)]
    pub(crate) fn new(obstacle: &Obstacle, arm_links: &[usize], origin_m: [f64; 3]) -> Self {
        let (carrier, local) = match obstacle.placement {
            Placement::World(pose) => (Carrier::World, pose),
            Placement::Attach(pose) => (Carrier::Attach, pose),
            Placement::ArmLink { link, pose } => {
                let index = arm_links.iter().position(|l| *l == link);
                (Carrier::ArmLink(index.unwrap_or(0)), pose)
            }
        };
        Self {
            shape: obstacle.shape,
            friction: V::splat(obstacle.friction),
            carrier,
            local,
            frame: Frame::fixed(&local, origin_m),
            first_middle: V::splat(0.0),
            first_node: V::splat(0.0),
        }
    }

    /// Moves it to where its carrier is at the end of the step.
    #[inline(always)]
    pub(crate) fn follow(&mut self, attach: &BaseState<V>, arm: &[BaseState<V>]) {
        match self.carrier {
            Carrier::World | Carrier::Domino => {}
            Carrier::Attach => self.frame = Frame::carried(attach, &self.local),
            Carrier::ArmLink(index) => {
                if let Some(link) = arm.get(index) {
                    self.frame = Frame::carried(link, &self.local);
                }
            }
        }
    }

    /// Distance (m) of the world point `x` to the surface, and its gradient.
    #[inline(always)]
    pub(crate) fn distance(&self, x: Vec3<V>) -> (V, Vec3<V>) {
        let (d, n) = shape::distance(&self.shape, self.frame.to_local(x));
        (d, self.frame.to_world(n))
    }

    /// Lets pass the links of one lane that touch it while the rope leaves the attach
    /// frame straight.
    #[inline(always)]
    pub(crate) fn exempt_mounting(&mut self, lane: usize, rope: &RopeParams) {
        if self.carrier != Carrier::Attach {
            return;
        }
        let is_free = |node: u32| {
            let down_m = rope.link_length_m() * f64::from(node);
            let p = self.local.inverse() * Point3::new(0.0, 0.0, -down_m);
            let (distance_m, _) = shape::distance(&self.shape, Vec3::<f64>(p.x, p.y, p.z));
            distance_m > rope.radius_m + MOUNTING_GAP_M
        };
        let first_free = (0..=rope.links).find(|n| is_free(*n)).unwrap_or(rope.links);
        self.first_middle.set(lane, f64::from(first_free));
        self.first_node
            .set(lane, f64::from(first_free.saturating_sub(1)));
    }
}
