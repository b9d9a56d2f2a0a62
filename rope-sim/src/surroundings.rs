//! What a group of ropes meets besides gravity: obstacles, air, its own rest shape and
//! unevenness.

use crate::algebra::Quat;
use crate::base_path::BasePath;
use crate::clock::{BaseState, Clock};
use crate::contact::{Contacts, LOOK_PERIOD, Node, Predicted, StepEnd, corrected, predicted};
use crate::drag::DragLanes;
use crate::extras::RopeExtras;
use crate::group::{GroupTask, Member};
use crate::kernel::{Elimination, StepReport, step};
use crate::lanes::Lanes;
use crate::load::{LinkLoads, Load, Loads, Unloaded};
use crate::scene::{ContactSummary, DominoOutcome};
use crate::scheme::Scheme;
use crate::state::{Link, RopeLanes};
use crate::uneven::UnevenLanes;
use nalgebra::{UnitQuaternion, Vector3};
use shared_types::RopeParams;

/// Obstacles, air, rest shape and unevenness of a group, with the loads of the current step.
pub(crate) struct Around<V> {
    pub(crate) contacts: Contacts<V>,
    drag: Option<DragLanes<V>>,
    uneven: Option<UnevenLanes<V>>,
    rest_turn: Quat<V>,
    is_curved: bool,
    nodes: Vec<Node<V>>,
    loads: LinkLoads<V>,
    steps: usize,
}

impl<V: Lanes> Loads<V> for Around<V> {
    const PRESENT: bool = true;
    #[inline(always)]
    fn on_link(&self, link: usize) -> Option<&Load<V>> {
        self.loads.on_link(link)
    }
    #[inline(always)]
    fn rest_turn(&self) -> Quat<V> {
        self.rest_turn
    }
}

impl<V: Lanes> Around<V> {
    /// Air, rest shape and unevenness of `ropes`, one per lane, among `contacts`.
    #[inline(always)]
    pub(crate) fn new(contacts: Contacts<V>, ropes: &[(&RopeParams, RopeExtras)]) -> Self {
        let links = ropes.first().map_or(0, |(r, _)| r.links as usize);
        let mut drag = DragLanes::none();
        let mut uneven = UnevenLanes::even(links);
        let mut rest_turn = Quat::identity();
        for lane in 0..V::COUNT {
            let Some((rope, extras)) = ropes.get(lane).or_else(|| ropes.last()) else {
                continue;
            };
            drag.set(lane, rope, extras);
            uneven.set(lane, rope, extras);
            let curvature = Vector3::from(extras.rest_curvature_per_m);
            let q = UnitQuaternion::from_scaled_axis(curvature * rope.link_length_m());
            rest_turn.set(lane, [q.w, q.i, q.j, q.k]);
        }
        let any_drag = ropes.iter().any(|(_, e)| e.air_drag.is_some());
        let any_uneven = ropes.iter().any(|(_, e)| e.mass_slope.abs() > 0.0);
        let bends = |c: &f64| c.abs() > 0.0;
        Self {
            contacts,
            drag: any_drag.then_some(drag),
            uneven: any_uneven.then_some(uneven),
            rest_turn,
            is_curved: ropes
                .iter()
                .any(|(_, e)| e.rest_curvature_per_m.iter().any(bends)),
            nodes: vec![Node::zero(); links],
            loads: LinkLoads::new(links),
            steps: 0,
        }
    }

    /// Looks around from where the rope is.
    #[inline(always)]
    pub(crate) fn look(
        &mut self,
        links: &[Link<V>],
        rope: &RopeLanes<V>,
        attach: &BaseState<V>,
        arm: &[BaseState<V>],
    ) {
        corrected(&mut self.nodes, links, rope, attach);
        self.contacts.look(&self.nodes, rope, attach, arm);
    }

    /// Advances every lane by one step.
    #[inline(always)]
    pub(crate) fn step(
        &mut self,
        links: &mut [Link<V>],
        scratch: &mut [Elimination<V>],
        rope: &RopeLanes<V>,
        scheme: &Scheme<V>,
        (attach, arm): (&BaseState<V>, &[BaseState<V>]),
        ends: &[StepEnd],
    ) -> StepReport<V> {
        let in_contact = self.contacts.is_engaged();
        self.steps += 1;
        let look = self.steps.is_multiple_of(LOOK_PERIOD);
        let loaded = self.drag.is_some() || self.uneven.is_some();
        if !(in_contact || self.is_curved || loaded) {
            let report = step(links, scratch, rope, &attach.dynamics, scheme, &Unloaded);
            if look {
                self.look(links, rope, attach, arm);
            }
            return report;
        }
        for link in links.iter_mut() {
            link.predict(scheme);
        }
        predicted(&mut self.nodes, links, rope, attach, scheme);
        self.loads.clear();
        self.add_drag(links, rope, scheme);
        self.add_unevenness(links, scheme);
        if in_contact {
            let predicted = Predicted {
                links,
                nodes: &self.nodes,
                scheme,
            };
            self.contacts.load(&mut self.loads, predicted, attach, arm);
        }
        let report = step(links, scratch, rope, &attach.dynamics, scheme, &*self);
        if in_contact {
            corrected(&mut self.nodes, links, rope, attach);
            self.contacts.settle(links, &self.nodes, scheme, ends);
        }
        if look {
            self.look(links, rope, attach, arm);
        }
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
    fn add_unevenness(&mut self, links: &[Link<V>], scheme: &Scheme<V>) {
        let Some(uneven) = &self.uneven else { return };
        for (index, (link, node)) in links.iter().zip(&self.nodes).enumerate() {
            let load = uneven.on_link(index, link, node.span, scheme);
            self.loads.add(index, &load);
        }
    }
}

/// [`Around`] on the clock of a group.
pub(crate) struct Surroundings<'a, V> {
    around: Around<V>,
    /// One clock per arm link that carries obstacles, in step with the group's.
    arm: Vec<Clock<'a, V>>,
    arm_states: Vec<BaseState<V>>,
    arm_rope: RopeLanes<V>,
    ends: Vec<StepEnd>,
    /// Whether any lane restarts at every step.
    restarting: bool,
}

impl<'a, V: Lanes> Surroundings<'a, V> {
    #[inline(always)]
    pub(crate) fn new<const ALONE: bool>(
        task: &GroupTask<'a, ALONE>,
        plain: &[&'a RopeParams],
    ) -> Self {
        let origin_m = task.watch.origin_m();
        let members: &'a [Member<'a>] = task.members;
        let ropes: Vec<_> = members.iter().map(|m| (m.rope, m.extras)).collect();
        let contacts = Contacts::new(task.scene, plain, task.max_step_s, origin_m);
        let carriers = members.first().map_or(0, |m| m.arm.len());
        let arm = (0..carriers)
            .map(|carrier| {
                let paths: Vec<&'a BasePath> = members.iter().map(|m| &m.arm[carrier]).collect();
                Clock::new(&paths, plain, origin_m)
            })
            .collect();
        Self {
            around: Around::new(contacts, &ropes),
            arm,
            arm_states: Vec::with_capacity(carriers),
            arm_rope: RopeLanes::of(plain[0]),
            ends: Vec::with_capacity(members.len()),
            restarting: false,
        }
    }

    /// First look, before the first step.
    #[inline(always)]
    pub(crate) fn begin(&mut self, links: &[Link<V>], rope: &RopeLanes<V>, attach: &BaseState<V>) {
        self.read_arm();
        self.around.look(links, rope, attach, &self.arm_states);
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
        let mut restarts = Vec::new();
        for arm in &mut self.arm {
            arm.next_step(&mut self.arm_rope, &mut restarts);
        }
        self.read_arm();
        if self.around.contacts.is_engaged() {
            self.read_clock(clock);
        }
        let carriers = (attach, self.arm_states.as_slice());
        let report = self
            .around
            .step(links, scratch, rope, &clock.scheme, carriers, &self.ends);
        let imminent = self.around.contacts.imminent;
        let any = V::any_less(V::splat(0.0), imminent);
        if any || self.restarting {
            for lane in 0..clock.lanes() {
                clock.keep_restarting(lane, imminent.get(lane) > 0.0);
            }
        }
        self.restarting = any;
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

    #[inline(always)]
    fn read_arm(&mut self) {
        self.arm_states.clear();
        self.arm_states.extend(self.arm.iter().map(Clock::base));
    }

    pub(crate) fn summaries_of(&self, lane: usize) -> Vec<ContactSummary> {
        self.around.contacts.summaries_of(lane)
    }

    pub(crate) fn domino_of(&self, lane: usize) -> Option<DominoOutcome> {
        self.around.contacts.domino_of(lane)
    }
}
