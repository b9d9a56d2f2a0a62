//! The loads that [`RopeExtras`] put on a rope: drag of still air, and mass that is uneven
//! along it.
//!
//! Along and across a link the drag is taken against the velocity at the end of the step with
//! the speed of the prediction, so it only ever takes energy away. The elimination knows links
//! of one mass: what a link has more or less than that rides at its centre, as a load.

use crate::algebra::{Sym3, Vec3};
use crate::contact::Node;
use crate::extras::RopeExtras;
use crate::kernel::{centripetal, up};
use crate::lanes::Lanes;
use crate::load::Load;
use crate::scheme::Scheme;
use crate::state::Link;
use shared_types::RopeParams;

/// Force per speed squared (kg/m) of links and lead, one rope per lane.
pub(crate) struct DragLanes<V> {
    across: V,
    along: V,
    lead: V,
}

impl<V: Lanes> DragLanes<V> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let zero = V::splat(0.0);
        Self {
            across: zero,
            along: zero,
            lead: zero,
        }
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, rope: &RopeParams, extras: &RopeExtras) {
        let Some(drag) = extras.air_drag else {
            return;
        };
        let half_density = 0.5 * drag.air_density_kg_m3;
        let area_m2 = 2.0 * rope.radius_m * rope.link_length_m();
        let lead_m2 = core::f64::consts::PI * rope.lead_radius_m.powi(2);
        self.across
            .set(lane, half_density * area_m2 * drag.normal_coefficient);
        self.along
            .set(lane, half_density * area_m2 * drag.tangential_coefficient);
        self.lead
            .set(lane, half_density * lead_m2 * drag.lead_coefficient);
    }

    /// Drag of one link, at its predictions.
    #[inline(always)]
    pub(crate) fn on_link(
        &self,
        link: &Link<V>,
        node: &Node<V>,
        per_length: V,
        scheme: &Scheme<V>,
    ) -> Load<V> {
        let arm = node.span.scale(V::splat(-0.5));
        let v = link.w.cross_add(arm, node.v);
        let axis = node.span.scale(per_length);
        let slip = v.dot(axis);
        let sideways = axis.scale_sub(slip, v);
        let across = self.across * sideways.norm();
        let along = self.along * slip.abs();
        let force = sideways.scale_add(-across, axis.scale(-(along * slip)));
        let resistance = Sym3::diagonal(across)
            .plus_outer(along - across, axis)
            .scale(scheme.correct_w);
        Load::push(force, resistance, arm, link.al.cross_add(arm, node.a))
    }

    /// Drag of the lead.
    #[inline(always)]
    pub(crate) fn on_lead(&self, node: &Node<V>, scheme: &Scheme<V>) -> Load<V> {
        let factor = self.lead * node.v.norm();
        let force = node.v.scale(-factor);
        let resistance = Sym3::diagonal(factor * scheme.correct_w);
        Load::push(force, resistance, Vec3::zero(), node.a)
    }
}

/// Mass of every link beyond that of an even rope (kg), negative where it has less; one
/// rope per lane.
pub(crate) struct MassLanes<V> {
    beyond: Vec<V>,
}

impl<V: Lanes> MassLanes<V> {
    #[inline(always)]
    pub(crate) fn uniform(links: usize) -> Self {
        Self {
            beyond: vec![V::splat(0.0); links],
        }
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, rope: &RopeParams, extras: &RopeExtras) {
        for (link, beyond) in (0..rope.links).zip(&mut self.beyond) {
            let factor = extras.mass_factor(link, rope.links);
            beyond.set(lane, rope.link_mass_kg() * (factor - 1.0));
        }
    }

    /// What one predicted link carries; `span` is that from its nearer to its farther
    /// node. Together with the link's own mass it is never negative.
    #[inline(always)]
    pub(crate) fn on_link(
        &self,
        index: usize,
        link: &Link<V>,
        span: Vec3<V>,
        scheme: &Scheme<V>,
    ) -> Load<V> {
        let mass = self.beyond[index];
        // The centre lags half a span behind the farther node.
        let inward = centripetal(link, span, scheme).scale(V::splat(0.5));
        let force = inward.sub(up()).scale(mass);
        let arm = span.scale(V::splat(-0.5));
        Load::push(force, Sym3::diagonal(mass), arm, Vec3::zero())
    }
}
