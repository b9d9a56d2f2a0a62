//! Mass that is uneven along a rope, see [`RopeExtras::mass_slope`].
//!
//! The elimination knows links of one mass. What a link has more or less than that rides at
//! its centre, as a load.

use crate::algebra::{Sym3, Vec3};
use crate::extras::RopeExtras;
use crate::kernel::{centripetal, up};
use crate::lanes::Lanes;
use crate::load::Load;
use crate::scheme::Scheme;
use crate::state::Link;
use shared_types::RopeParams;

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
