//! The joints' torques, with the predictions of the links they join.

use super::link::{Elimination, centripetal};
use crate::algebra::{Quat, Vec3};
use crate::lanes::Lanes;
use crate::load::Loads;
use crate::scheme::Scheme;
use crate::state::{BaseLanes, Link, RopeLanes};

/// What a joint feels of one of the bodies it joins.
#[derive(Clone, Copy)]
pub(super) struct Ends<V> {
    q: Quat<V>,
    /// `al - c w`: acceleration guess and damping, whose difference over the joint
    /// is a part of its torque.
    pull: Vec3<V>,
}

impl<V: Lanes> Ends<V> {
    #[inline(always)]
    pub(super) fn of(link: &Link<V>, rope: &RopeLanes<V>) -> Self {
        Self {
            q: link.q,
            pull: link.w.scale_sub(rope.damping, link.al),
        }
    }
}

/// Joint by joint towards the attach point: predictions and torques.
pub(super) struct Joints<V> {
    base: Ends<V>,
    /// Of the link whose joint comes next.
    pub(super) child: Ends<V>,
    /// Of the link prepared last (m).
    pub(super) span: Vec3<V>,
}

impl<V: Lanes> Joints<V> {
    #[inline(always)]
    pub(super) fn new(base: &BaseLanes<V>, rope: &RopeLanes<V>) -> Self {
        let base = Ends {
            q: base.q,
            pull: base.w.scale_sub(rope.damping, base.alpha),
        };
        Self {
            base,
            child: base,
            span: Vec3::zero(),
        }
    }

    /// Fills in what the elimination of the last of `links`, already predicted, needs,
    /// and predicts the link before it. The centripetal acceleration takes the place
    /// of the acceleration change, which nothing needs any more: with a vector less
    /// each, the links of a rope stay in the fastest cache.
    #[inline(always)]
    pub(super) fn prepare<L: Loads<V>>(
        &mut self,
        links: &mut [Link<V>],
        scratch: &mut [Elimination<V>],
        rope: &RopeLanes<V>,
        scheme: &Scheme<V>,
        loads: &L,
    ) {
        let (Some((link, nearer)), Some(space)) = (links.split_last_mut(), scratch.last_mut())
        else {
            return;
        };
        self.span = link.q.down(rope.link_length);
        link.al_change = centripetal(link, self.span, scheme);
        let parent = match nearer.last_mut() {
            Some(parent) => {
                if !L::PRESENT {
                    parent.predict(scheme);
                }
                Ends::of(parent, rope)
            }
            None => self.base,
        };
        let turn = if L::PRESENT {
            self.child.q.times_conj(parent.q.times(loads.rest_turn()))
        } else {
            self.child.q.times_conj(parent.q)
        };
        let pull = self.child.pull.sub(parent.pull);
        let torque = turn.v.scale_sub(spring(rope, turn.w), pull);
        space.y = match loads.joint_moment(nearer.len()) {
            Some(moment) => moment.scale_sub(rope.per_resistance, torque),
            None => torque,
        };
        self.child = parent;
    }
}

/// Stiffness times joint angle over the sine of the half angle: a polynomial in
/// `1 - |cos|` of the half angle; the sign picks the rotation of at most half a turn.
#[inline(always)]
pub(crate) fn spring<V: Lanes>(rope: &RopeLanes<V>, half_cos: V) -> V {
    let x = V::splat(1.0) - half_cos.abs();
    let mut f = V::splat(0.0);
    let mut first = true;
    let mut power = V::ANGLE_POLYNOMIAL.len();
    while power > 0 {
        power -= 1;
        let coefficient = V::splat(V::ANGLE_POLYNOMIAL[power]);
        f = if first {
            coefficient
        } else {
            f.fma(x, coefficient)
        };
        first = false;
    }
    (f * rope.stiffness).flip_by(half_cos)
}
