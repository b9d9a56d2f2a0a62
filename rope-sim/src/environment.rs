//! What a group of ropes meets besides gravity: obstacles, air, its own rest shape and
//! mass distribution.

use crate::clock::{BaseState, Clock};
use crate::contact::{Contacts, LOOK_PERIOD, Node, Predicted, StepEnd, corrected, predicted};
use crate::extra_loads::{DragLanes, MassLanes};
use crate::extras::RopeExtras;
use crate::kernel::{Elimination, StepReport, step};
use crate::lanes::Lanes;
use crate::load::{LinkLoads, Unloaded};
use crate::scheme::Scheme;
use crate::state::{Link, RopeLanes};
use nalgebra::{UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Obstacles, air, rest shape and mass distribution of a group, with the loads of the
/// current step.
pub(crate) struct Environment<V> {
    pub(crate) contacts: Contacts<V>,
    drag: Option<DragLanes<V>>,
    masses: Option<MassLanes<V>>,
    is_curved: bool,
    nodes: Vec<Node<V>>,
    loads: LinkLoads<V>,
    steps: usize,
    ends: Vec<StepEnd>,
    /// Whether any lane restarts at every step.
    restarting: bool,
}

impl<V: Lanes> Environment<V> {
    /// Air, rest shape and mass distribution of `ropes`, one per lane, among `contacts`.
    #[inline(always)]
    pub(crate) fn new(contacts: Contacts<V>, ropes: &[(&RopeParams, RopeExtras)]) -> Self {
        let links = ropes.first().map_or(0, |(r, _)| r.links as usize);
        let mut drag = DragLanes::none();
        let mut masses = MassLanes::uniform(links);
        let mut loads = LinkLoads::new(links);
        for lane in 0..V::COUNT {
            let Some((rope, extras)) = ropes.get(lane).or_else(|| ropes.last()) else {
                continue;
            };
            drag.set(lane, rope, extras);
            masses.set(lane, rope, extras);
            let curvature = Vector3::from(extras.rest_curvature_per_m);
            let q = UnitQuaternion::from_scaled_axis(curvature * rope.link_length_m());
            loads.rest_turn.set(lane, [q.w, q.i, q.j, q.k]);
        }
        let any_drag = ropes.iter().any(|(_, e)| e.air_drag.is_some());
        let any_slope = ropes.iter().any(|(_, e)| e.mass_slope.abs() > 0.0);
        let bends = |c: &f64| c.abs() > 0.0;
        Self {
            contacts,
            drag: any_drag.then_some(drag),
            masses: any_slope.then_some(masses),
            is_curved: ropes
                .iter()
                .any(|(_, e)| e.rest_curvature_per_m.iter().any(bends)),
            nodes: vec![Node::zero(); links],
            loads,
            steps: 0,
            ends: Vec::with_capacity(ropes.len()),
            restarting: false,
        }
    }

    /// Looks around from where the rope is.
    #[inline(always)]
    pub(crate) fn look(&mut self, links: &[Link<V>], rope: &RopeLanes<V>, attach: &BaseState<V>) {
        corrected(&mut self.nodes, links, rope, attach);
        self.contacts.look(&self.nodes, rope);
    }

    /// Advances every lane by one step of `clock`, and tells it which lanes must
    /// restart.
    #[inline(always)]
    pub(crate) fn step(
        &mut self,
        links: &mut [Link<V>],
        scratch: &mut [Elimination<V>],
        rope: &RopeLanes<V>,
        attach: &BaseState<V>,
        clock: &mut Clock<V>,
    ) -> StepReport<V> {
        let scheme = &clock.scheme;
        let in_contact = self.contacts.is_engaged();
        self.steps += 1;
        let loaded = self.drag.is_some() || self.masses.is_some();
        let report = if in_contact || self.is_curved || loaded {
            for link in links.iter_mut() {
                link.predict(scheme);
            }
            predicted(&mut self.nodes, links, rope, attach, scheme);
            self.loads.clear();
            self.add_drag(links, rope, scheme);
            self.add_masses(links, scheme);
            if in_contact {
                let predicted = Predicted {
                    links,
                    nodes: &self.nodes,
                    attach: attach.position,
                    scheme,
                };
                self.contacts.load(&mut self.loads, predicted);
            }
            let report = step(links, scratch, rope, &attach.dynamics, scheme, &self.loads);
            if in_contact {
                corrected(&mut self.nodes, links, rope, attach);
                self.read_clock(clock);
                self.contacts.settle(links, &self.nodes, scheme, &self.ends);
            }
            report
        } else {
            step(links, scratch, rope, &attach.dynamics, scheme, &Unloaded)
        };
        if self.steps.is_multiple_of(LOOK_PERIOD) {
            self.look(links, rope, attach);
        }
        self.restart_lanes(clock);
        report
    }

    #[inline(always)]
    fn add_drag(&mut self, links: &[Link<V>], rope: &RopeLanes<V>, scheme: &Scheme<V>) {
        let Some(drag) = &self.drag else { return };
        let per_length = rope.link_length.recip();
        for (index, (link, node)) in links.iter().zip(&self.nodes).enumerate() {
            let load = drag.on_link(link, node, per_length, scheme);
            self.loads.add(index, &load);
        }
        if let Some(node) = self.nodes.last() {
            self.loads.add(links.len() - 1, &drag.on_lead(node, scheme));
        }
    }

    #[inline(always)]
    fn add_masses(&mut self, links: &[Link<V>], scheme: &Scheme<V>) {
        let Some(masses) = &self.masses else { return };
        for (index, (link, node)) in links.iter().zip(&self.nodes).enumerate() {
            let load = masses.on_link(index, link, node.span, scheme);
            self.loads.add(index, &load);
        }
    }

    #[inline(always)]
    fn read_clock(&mut self, clock: &Clock<V>) {
        self.ends.clear();
        self.ends.extend((0..clock.lanes()).map(|lane| {
            let (start_s, time_s) = clock.span_s(lane);
            StepEnd {
                time_s,
                step_s: time_s - start_s,
                running: !clock.finished(lane),
            }
        }));
    }

    /// Makes every coming step of lanes that are about to touch a restart.
    #[inline(always)]
    fn restart_lanes(&mut self, clock: &mut Clock<V>) {
        let imminent = self.contacts.imminent;
        let any = V::any_less(V::splat(0.0), imminent);
        if any || self.restarting {
            for lane in 0..clock.lanes() {
                clock.keep_restarting(lane, imminent.get(lane) > 0.0);
            }
        }
        self.restarting = any;
    }
}
