//! What a group of ropes meets besides gravity: obstacles, and what the ropes have beyond
//! their nine parameters.

use crate::clock::{BaseState, Clock};
use crate::contact::{Contacts, LOOK_PERIOD, Node, Predicted, StepEnd, corrected, predicted};
use crate::extra_loads::ExtraLanes;
use crate::kernel::{Elimination, StepReport, step};
use crate::lanes::Lanes;
use crate::load::{LinkLoads, Unloaded};
use crate::state::{Link, RopeLanes};
use shared_types::RopeParams;

/// Obstacles and extras of a group, with the loads of the current step.
pub(crate) struct Environment<V> {
    pub(crate) contacts: Contacts<V>,
    extras: ExtraLanes<V>,
    nodes: Vec<Node<V>>,
    loads: LinkLoads<V>,
    steps: usize,
    ends: Vec<StepEnd>,
    /// Whether any lane restarts at every step.
    restarting: bool,
}

impl<V: Lanes> Environment<V> {
    /// Extras of `ropes`, one per lane, among `contacts`.
    #[inline(always)]
    pub(crate) fn new(contacts: Contacts<V>, ropes: &[&RopeParams]) -> Self {
        let links = ropes.first().map_or(0, |rope| rope.links as usize);
        let mut loads = LinkLoads::new(links);
        Self {
            contacts,
            extras: ExtraLanes::new(ropes, &mut loads),
            nodes: vec![Node::zero(); links],
            loads,
            steps: 0,
            ends: Vec::with_capacity(ropes.len()),
            restarting: false,
        }
    }

    /// Moments of friction of a lane (N m, world); empty for none.
    #[inline(always)]
    pub(crate) fn friction_nm(&self, lane: usize) -> Vec<[f64; 3]> {
        let friction = self.extras.friction.as_ref();
        friction.map_or_else(Vec::new, |friction| friction.moments_nm(lane))
    }

    /// Looks around from where the ropes start, with moments of friction (N m, world) that are
    /// empty for none.
    #[inline(always)]
    pub(crate) fn start<'m>(
        &mut self,
        friction_nm: impl Iterator<Item = &'m [[f64; 3]]>,
        links: &[Link<V>],
        rope: &RopeLanes<V>,
        attach: &BaseState<V>,
    ) {
        if let Some(friction) = &mut self.extras.friction {
            for (lane, moments_nm) in friction_nm.enumerate() {
                friction.put(lane, moments_nm);
            }
        }
        self.extras.start(links, &attach.dynamics);
        self.look(links, rope, attach);
    }

    /// Looks around from where the rope is.
    #[inline(always)]
    fn look(&mut self, links: &[Link<V>], rope: &RopeLanes<V>, attach: &BaseState<V>) {
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
        let report = if in_contact || self.extras.is_any() {
            for link in links.iter_mut() {
                link.predict(scheme);
            }
            predicted(&mut self.nodes, links, rope, attach, scheme);
            self.loads.clear();
            let base = &attach.dynamics;
            self.extras
                .load(&mut self.loads, links, &self.nodes, rope, base, scheme);
            if in_contact {
                let predicted = Predicted {
                    links,
                    nodes: &self.nodes,
                    attach: attach.position,
                    scheme,
                };
                self.contacts.load(&mut self.loads, predicted);
            }
            let report = step(links, scratch, rope, base, scheme, &self.loads);
            self.extras.settle(links, base, scheme);
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
