//! Dry friction in bending: Dahl's model in every joint, one rope per lane.
//!
//! Over a step in which the joint turns at a constant rate the model has a closed form; its
//! exponential is taken as a fraction that falls to zero and never lets the moment pass its
//! limit, for any step. The joint's resistance to acceleration counts the friction's first stiffness
//! ([`crate::scheme::joint_resistance`]), which keeps the step stable.

use crate::algebra::Vec3;
use crate::lanes::Lanes;
use crate::state::{BaseLanes, Link};
use shared_types::RopeParams;

/// Friction of all joints of a group.
#[derive(Clone)]
pub(crate) struct FrictionLanes<V> {
    /// Stiffness before a joint slips (N m/rad).
    stiffness: V,
    /// Inverse of the angle over which the moment comes up (1/rad).
    per_slip_angle: V,
    /// The first joint's friction as a multiple of the others'.
    clamp: V,
    joints: Vec<Joint<V>>,
}

/// A joint as the last step left it.
#[derive(Clone, Copy)]
struct Joint<V> {
    /// Moment that resists its turning (N m, world).
    moment: Vec3<V>,
    /// Angular velocity of its link against the one before (rad/s, world).
    rate: Vec3<V>,
}

impl<V: Lanes> FrictionLanes<V> {
    #[inline(always)]
    pub(crate) fn none(links: usize) -> Self {
        let zero = V::splat(0.0);
        let at_rest = Joint {
            moment: Vec3::zero(),
            rate: Vec3::zero(),
        };
        Self {
            stiffness: zero,
            per_slip_angle: zero,
            clamp: V::splat(1.0),
            joints: vec![at_rest; links],
        }
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, rope: &RopeParams) {
        let Some(friction) = rope.beyond().friction else {
            return;
        };
        let slip_angle_rad = friction.slip_curvature_per_m * rope.link_length_m();
        self.stiffness
            .set(lane, rope.friction_stiffness_nm_per_rad());
        self.per_slip_angle.set(lane, 1.0 / slip_angle_rad);
        self.clamp.set(lane, rope.beyond().clamp_stiffness);
    }

    /// Moments that a lane starts with (N m, world); empty for none.
    #[inline(always)]
    pub(crate) fn put(&mut self, lane: usize, moments_nm: &[[f64; 3]]) {
        for (joint, moment) in self.joints.iter_mut().zip(moments_nm) {
            joint.moment.set(lane, *moment);
        }
    }

    /// Moments of a lane (N m, world).
    #[inline(always)]
    pub(crate) fn moments_nm(&self, lane: usize) -> Vec<[f64; 3]> {
        self.joints.iter().map(|j| j.moment.get(lane)).collect()
    }

    /// Notes how the joints turn at the start.
    #[inline(always)]
    pub(crate) fn start(&mut self, links: &[Link<V>], attach: &BaseLanes<V>) {
        let mut before = attach.w;
        for (joint, link) in self.joints.iter_mut().zip(links) {
            joint.rate = link.w.sub(before);
            before = link.w;
        }
    }

    /// Moments that resist (N m, world) once the links move as they do now, `h` (s) after
    /// the last step.
    #[inline(always)]
    pub(crate) fn moments(
        &self,
        out: &mut [Vec3<V>],
        links: &[Link<V>],
        attach: &BaseLanes<V>,
        h: V,
    ) {
        let mut before = attach.w;
        for ((out, joint), link) in out.iter_mut().zip(&self.joints).zip(links) {
            *out = self.after(joint, link, link.w.sub(before), h);
            before = link.w;
        }
        if let Some(first) = out.first_mut() {
            *first = first.scale(self.clamp);
        }
    }

    /// Takes over where the step has led to.
    #[inline(always)]
    pub(crate) fn settle(&mut self, links: &[Link<V>], attach: &BaseLanes<V>, h: V) {
        let mut before = attach.w;
        for (index, link) in links.iter().enumerate() {
            let rate = link.w.sub(before);
            let moment = self.after(&self.joints[index], link, rate, h);
            self.joints[index] = Joint { moment, rate };
            before = link.w;
        }
    }

    #[inline(always)]
    fn after(&self, joint: &Joint<V>, link: &Link<V>, rate: Vec3<V>, h: V) -> Vec3<V> {
        let (one, half) = (V::splat(1.0), V::splat(0.5));
        let mean = rate.add(joint.rate).scale(half);
        // Way over the slip angle; exp(-way) by its (0, 2) Padé approximant.
        let way = mean.norm() * h * self.per_slip_angle;
        let kept = way.fma(way.fma(half, one), one).recip();
        // The moment turns with the link.
        let turn = link.w.scale(h);
        let turned = turn.cross_add(
            turn.cross_add(joint.moment.scale(half), joint.moment),
            joint.moment,
        );
        let gained = mean.scale(h * self.stiffness * way.fma(half, one) * kept);
        turned.scale_add(kept, gained)
    }
}
