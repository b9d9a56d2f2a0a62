//! A first joint that is stiffer or softer than the others, one rope per lane.
//!
//! What it resists beyond any other joint rides on the first link as a load: `(f - 1)`
//! times spring and damper, as implicit in the step as those of the other joints; its
//! friction is scaled alike ([`crate::friction`]).

use crate::algebra::Sym3;
use crate::kernel::spring;
use crate::lanes::Lanes;
use crate::load::{LinkLoads, Load};
use crate::state::{BaseLanes, Link, RopeLanes};
use shared_types::RopeParams;

/// Stiffness and damping of the first joint beyond the others', as a part of theirs.
#[derive(Clone)]
pub(crate) struct ClampLanes<V> {
    beyond: V,
}

impl<V: Lanes> ClampLanes<V> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let beyond = V::splat(0.0);
        Self { beyond }
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, rope: &RopeParams) {
        self.beyond.set(lane, rope.beyond().clamp_stiffness - 1.0);
    }

    /// Adds the load to the first link, at its predictions.
    #[inline(always)]
    pub(crate) fn load(
        &self,
        loads: &mut LinkLoads<V>,
        links: &[Link<V>],
        rope: &RopeLanes<V>,
        attach: &BaseLanes<V>,
    ) {
        let Some(link) = links.first() else { return };
        let turn = link.q.times_conj(attach.q.times(loads.rest_turn));
        let damper = link.w.sub(attach.w).scale(rope.damping);
        let pull = turn.v.scale_add(spring(rope, turn.w), damper).sub(link.al);
        // The kernel counts in units of the joint resistance.
        let factor = self.beyond * rope.per_resistance.recip();
        let load = Load {
            ww: Sym3::diagonal(factor),
            bw: pull.scale(factor),
            ..Load::none()
        };
        loads.add(0, &load);
    }
}
