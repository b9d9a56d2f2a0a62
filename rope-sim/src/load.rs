//! What acts on a rope besides gravity and its joints' springs and dampers.

use crate::algebra::{Mat3, Quat, Sym3, Vec3};
use crate::lanes::Lanes;

/// Reaction of what touches a link, at its farther node: for an acceleration `a` of
/// the node and `alpha` of the link, `force = vv a + vw alpha + bv`, `torque = vw^T a +
/// ww alpha + bw` (N, N m).
#[derive(Clone, Copy)]
pub(crate) struct Load<V> {
    pub(crate) vv: Sym3<V>,
    pub(crate) vw: Mat3<V>,
    pub(crate) ww: Sym3<V>,
    pub(crate) bv: Vec3<V>,
    pub(crate) bw: Vec3<V>,
}

impl<V: Lanes> Load<V> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let none = Sym3::diagonal(V::splat(0.0));
        Self {
            vv: none,
            vw: Mat3::zero(),
            ww: none,
            bv: Vec3::zero(),
            bw: Vec3::zero(),
        }
    }

    /// Both.
    #[inline(always)]
    pub(crate) fn plus(&self, o: &Self) -> Self {
        Self {
            vv: self.vv.add(o.vv),
            vw: self.vw.add(&o.vw),
            ww: self.ww.add(o.ww),
            bv: self.bv.add(o.bv),
            bw: self.bw.add(o.bw),
        }
    }

    /// A force on the link at `arm` from the node: `force` while the point moves as
    /// predicted, with acceleration `predicted` apart from the centripetal part, less
    /// `resistance` (symmetric, not negative) times any acceleration beyond.
    #[inline(always)]
    pub(crate) fn push(
        force: Vec3<V>,
        resistance: Sym3<V>,
        arm: Vec3<V>,
        predicted: Vec3<V>,
    ) -> Self {
        let none = Vec3::zero();
        let [r0, r1, r2] = resistance.rows();
        let vw = [
            arm.cross_add(r0, none),
            arm.cross_add(r1, none),
            arm.cross_add(r2, none),
        ];
        let Vec3(x, y, z) = arm;
        let ww = Sym3 {
            xx: y.fma(vw[2].0, -(z * vw[1].0)),
            xy: y.fma(vw[2].1, -(z * vw[1].1)),
            xz: y.fma(vw[2].2, -(z * vw[1].2)),
            yy: z.fma(vw[0].1, -(x * vw[2].1)),
            yz: z.fma(vw[0].2, -(x * vw[2].2)),
            zz: x.fma(vw[1].2, -(y * vw[0].2)),
        };
        let bv = none.sub(resistance.times_add(predicted, force));
        Self {
            vv: resistance,
            vw: Mat3(vw),
            ww,
            bv,
            bw: arm.cross_add(bv, none),
        }
    }
}

/// What the kernel asks about the loads of one step.
pub(crate) trait Loads<V> {
    /// Whether there are any. If so, the links are predicted before the step, because
    /// loads depend on where the rope is going to be.
    const PRESENT: bool;
    /// Load on one link, counted from the attach point, if it has any in any lane.
    fn on_link(&self, link: usize) -> Option<&Load<V>>;
    /// Turn of a link against the one before in an unloaded rope.
    fn rest_turn(&self) -> Quat<V>;
    /// Moment by which a link's nearer joint resists its turning beyond spring and damper
    /// (N m, world), if any does in any lane.
    fn joint_moment(&self, link: usize) -> Option<Vec3<V>>;
}

/// Nothing acts; the compiler leaves no trace of it.
pub(crate) struct Unloaded;

impl<V: Lanes> Loads<V> for Unloaded {
    const PRESENT: bool = false;
    #[inline(always)]
    fn on_link(&self, _link: usize) -> Option<&Load<V>> {
        None
    }
    #[inline(always)]
    fn rest_turn(&self) -> Quat<V> {
        Quat::identity()
    }
    #[inline(always)]
    fn joint_moment(&self, _link: usize) -> Option<Vec3<V>> {
        None
    }
}

/// The loads of one step as they come together, link by link.
#[derive(Clone)]
pub(crate) struct LinkLoads<V> {
    loads: Vec<Load<V>>,
    /// Whether a link has any.
    present: Vec<bool>,
    pub(crate) rest_turn: Quat<V>,
    /// By joint; empty where no joint resists.
    pub(crate) joint_moments: Vec<Vec3<V>>,
}

impl<V: Lanes> LinkLoads<V> {
    /// No loads on a rope that rests straight.
    #[inline(always)]
    pub(crate) fn new(links: usize) -> Self {
        Self {
            loads: vec![Load::none(); links],
            present: vec![false; links],
            rest_turn: Quat::identity(),
            joint_moments: Vec::new(),
        }
    }

    /// Takes all loads off.
    #[inline(always)]
    pub(crate) fn clear(&mut self) {
        self.present.fill(false);
    }

    #[inline(always)]
    pub(crate) fn add(&mut self, link: usize, load: &Load<V>) {
        self.loads[link] = if self.present[link] {
            self.loads[link].plus(load)
        } else {
            *load
        };
        self.present[link] = true;
    }
}

impl<V: Lanes> Loads<V> for LinkLoads<V> {
    const PRESENT: bool = true;
    #[inline(always)]
    fn on_link(&self, link: usize) -> Option<&Load<V>> {
        self.present[link].then(|| &self.loads[link])
    }
    #[inline(always)]
    fn rest_turn(&self) -> Quat<V> {
        self.rest_turn
    }
    #[inline(always)]
    fn joint_moment(&self, link: usize) -> Option<Vec3<V>> {
        self.joint_moments.get(link).copied()
    }
}
