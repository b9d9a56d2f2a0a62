//! What [`shared_types::RopeExtras`] do to a rope: drag of still air and mass that is uneven
//! along it as loads, a rest curvature, dry friction and a first joint of its own.
//!
//! Along and across a link the drag is taken against the velocity at the end of the step with
//! the speed of the prediction, so it only ever takes energy away. The elimination knows links
//! of one mass: what a link has more or less than that rides at its centre, as a load.

use crate::algebra::{Sym3, Vec3};
use crate::clamp::ClampLanes;
use crate::contact::Node;
use crate::friction::FrictionLanes;
use crate::kernel::{centripetal, up};
use crate::lanes::Lanes;
use crate::load::{LinkLoads, Load};
use crate::scheme::Scheme;
use crate::state::{BaseLanes, Link, RopeLanes};
use nalgebra::{UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Extras of a group's ropes, one per lane; what no rope has costs nothing.
#[derive(Clone)]
pub(crate) struct ExtraLanes<V> {
    drag: Option<DragLanes<V>>,
    masses: Option<MassLanes<V>>,
    pub(crate) friction: Option<FrictionLanes<V>>,
    clamp: Option<ClampLanes<V>>,
    is_curved: bool,
}

impl<V: Lanes> ExtraLanes<V> {
    /// Extras of `ropes`, the last one's in all further lanes, with their rest turns put
    /// into `loads`.
    #[inline(always)]
    pub(crate) fn new(ropes: &[&RopeParams], loads: &mut LinkLoads<V>) -> Self {
        let links = ropes.first().map_or(0, |rope| rope.links as usize);
        let mut drag = DragLanes::none();
        let mut masses = MassLanes::uniform(links);
        let mut friction = FrictionLanes::none(links);
        let mut clamp = ClampLanes::none();
        for lane in 0..V::COUNT {
            let Some(rope) = ropes.get(lane).or_else(|| ropes.last()) else {
                continue;
            };
            drag.set(lane, rope);
            masses.set(lane, rope);
            friction.set(lane, rope);
            clamp.set(lane, rope);
            let curvature = Vector3::from(rope.beyond().rest_curvature_per_m);
            let q = UnitQuaternion::from_scaled_axis(curvature * rope.link_length_m());
            loads.rest_turn.set(lane, [q.w, q.i, q.j, q.k]);
        }
        let extras = || ropes.iter().filter_map(|rope| rope.extras);
        let has_friction = extras().any(|e| e.friction.is_some());
        if has_friction {
            loads.joint_moments = vec![Vec3::zero(); links];
        }
        let bends = |c: &f64| c.abs() > 0.0;
        Self {
            drag: extras().any(|e| e.air_drag.is_some()).then_some(drag),
            masses: extras().any(|e| e.mass_slope.abs() > 0.0).then_some(masses),
            friction: has_friction.then_some(friction),
            clamp: extras()
                .any(|e| (e.clamp_stiffness - 1.0).abs() > 0.0)
                .then_some(clamp),
            is_curved: extras().any(|e| e.rest_curvature_per_m.iter().any(bends)),
        }
    }

    /// Whether any rope has any.
    #[inline(always)]
    pub(crate) fn is_any(&self) -> bool {
        self.is_curved
            || self.drag.is_some()
            || self.masses.is_some()
            || self.friction.is_some()
            || self.clamp.is_some()
    }

    /// Notes how the ropes move at the start.
    #[inline(always)]
    pub(crate) fn start(&mut self, links: &[Link<V>], attach: &BaseLanes<V>) {
        if let Some(friction) = &mut self.friction {
            friction.start(links, attach);
        }
    }

    /// Adds what acts at the predictions.
    #[inline(always)]
    pub(crate) fn load(
        &self,
        loads: &mut LinkLoads<V>,
        links: &[Link<V>],
        nodes: &[Node<V>],
        rope: &RopeLanes<V>,
        attach: &BaseLanes<V>,
        scheme: &Scheme<V>,
    ) {
        if let Some(drag) = &self.drag {
            let per_length = rope.link_length.recip();
            for (index, (link, node)) in links.iter().zip(nodes).enumerate() {
                loads.add(index, &drag.on_link(link, node, per_length, scheme));
            }
            if let Some(node) = nodes.last() {
                loads.add(links.len() - 1, &drag.on_lead(node, scheme));
            }
        }
        if let Some(masses) = &self.masses {
            for (index, (link, node)) in links.iter().zip(nodes).enumerate() {
                loads.add(index, &masses.on_link(index, link, node.span, scheme));
            }
        }
        if let Some(clamp) = &self.clamp {
            clamp.load(loads, links, rope, attach);
        }
        if let Some(friction) = &self.friction {
            friction.moments(&mut loads.joint_moments, links, attach, scheme.h);
        }
    }

    /// Takes over where the step has led to.
    #[inline(always)]
    pub(crate) fn settle(&mut self, links: &[Link<V>], attach: &BaseLanes<V>, scheme: &Scheme<V>) {
        if let Some(friction) = &mut self.friction {
            friction.settle(links, attach, scheme.h);
        }
    }
}

/// Force per speed squared (kg/m) of links and lead, one rope per lane.
#[derive(Clone)]
struct DragLanes<V> {
    across: V,
    along: V,
    lead: V,
}

impl<V: Lanes> DragLanes<V> {
    #[inline(always)]
    fn none() -> Self {
        let zero = V::splat(0.0);
        Self {
            across: zero,
            along: zero,
            lead: zero,
        }
    }

    #[inline(always)]
    fn set(&mut self, lane: usize, rope: &RopeParams) {
        let Some(drag) = rope.beyond().air_drag else {
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
    fn on_link(
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
    fn on_lead(&self, node: &Node<V>, scheme: &Scheme<V>) -> Load<V> {
        let factor = self.lead * node.v.norm();
        let force = node.v.scale(-factor);
        let resistance = Sym3::diagonal(factor * scheme.correct_w);
        Load::push(force, resistance, Vec3::zero(), node.a)
    }
}

/// Mass of every link beyond that of an even rope (kg), negative where it has less; one
/// rope per lane.
#[derive(Clone)]
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
    pub(crate) fn set(&mut self, lane: usize, rope: &RopeParams) {
        let extras = rope.beyond();
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
