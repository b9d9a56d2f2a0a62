//! Contacts of ropes with obstacles.
//!
//! Every node (the lead at the last) and the point of every link that comes closest
//! to an obstacle can touch it; several obstacles add up. [`Touch`] is the law,
//! [`Body`] the obstacle, [`nodes`] the rope's motion.
//!
//! A rope that is about to touch integrates by restarts, one backward Euler step
//! after the other: the memory of the second-order scheme would give back part of
//! every impact a step later. Far from everything it is the plain rope, to the bit.
//! Whether it is far is decided from each lane's own motion.

mod body;
mod middle;
mod nodes;
mod shape;
mod summary;
mod touch;

pub(crate) use body::{Body, Carrier, Frame, constant};
pub(crate) use nodes::{Node, corrected, predicted};

use crate::algebra::Vec3;
use crate::clock::BaseState;
use crate::domino::DominoLanes;
use crate::lanes::Lanes;
use crate::load::Load;
use crate::scene::{ContactSummary, DominoOutcome, Scene, Shape};
use crate::scheme::Scheme;
use crate::state::{Link, RopeLanes};
use shared_types::RopeParams;
use summary::Summaries;
use touch::{Point, Touch};

/// Steps between two looks at how far everything is.
pub(crate) const LOOK_PERIOD: usize = 8;
/// What nodes and obstacles may gain in speed between two looks (m/s), above half as
/// much again as the fastest node.
const SPEED_ALLOWANCE_M_S: f64 = 12.0;
/// Stiffness of a link's surface (N/m): 0.01 mm under 1 N.
const LINK_STIFFNESS_N_M: f64 = 1e5;
/// Stiffness of a lead's surface (N/m): 120 g at 3 m/s push it in by less than 1 mm.
const LEAD_STIFFNESS_N_M: f64 = 2e6;
/// Contact points of a link: farther node, closest point.
const POINTS: usize = 2;

/// All contacts of a group of ropes.
pub(crate) struct Contacts<V> {
    bodies: Vec<Body<V>>,
    /// By body, link, point.
    touches: Vec<[Touch<V>; POINTS]>,
    /// Whether all lanes of both points of a link are as if never touched.
    idle: Vec<bool>,
    /// Per body, positive in lanes that are near.
    near: Vec<V>,
    engaged: Vec<bool>,
    /// How close a node must be for its link to be looked at (m).
    reach: V,
    radius: V,
    lead_radius: V,
    max_step: V,
    /// Positive in lanes that are about to touch.
    pub(crate) imminent: V,
    domino: Option<DominoLanes<V>>,
    summaries: Summaries,
}

impl<V: Lanes> Contacts<V> {
    /// Contacts of these ropes, one per lane, all with `links` links.
    #[inline(always)]
    pub(crate) fn new(
        scene: &Scene,
        ropes: &[&RopeParams],
        max_step_s: f64,
        origin_m: [f64; 3],
    ) -> Self {
        let arm_links = scene.arm_links();
        let links = ropes.first().map_or(0, |r| r.links as usize);
        let mut bodies: Vec<Body<V>> = scene
            .obstacles
            .iter()
            .map(|o| Body::new(o, &arm_links, origin_m))
            .collect();
        let mut radius = V::splat(0.0);
        let mut lead_radius = radius;
        for lane in 0..V::COUNT {
            let Some(rope) = ropes.get(lane).or_else(|| ropes.last()) else {
                continue;
            };
            for body in &mut bodies {
                body.exempt_mounting(lane, rope);
            }
            radius.set(lane, rope.radius_m);
            lead_radius.set(lane, rope.lead_radius_m.max(rope.radius_m));
        }
        let domino = scene
            .domino
            .as_ref()
            .map(|d| DominoLanes::new(d, ropes.len(), origin_m));
        bodies.extend(domino.as_ref().map(DominoLanes::body));
        let count = bodies.len();
        Self {
            touches: vec![[Touch::none(); POINTS]; count * links],
            idle: vec![true; count * links],
            near: vec![V::splat(0.0); count],
            engaged: vec![false; count],
            summaries: Summaries::new(count, ropes.len()),
            bodies,
            reach: V::splat(0.0),
            radius,
            lead_radius,
            max_step: V::splat(max_step_s),
            imminent: V::splat(0.0),
            domino,
        }
    }

    /// Whether anything may be touched before the next look.
    pub(crate) fn is_engaged(&self) -> bool {
        self.engaged.contains(&true) || self.domino.as_ref().is_some_and(DominoLanes::is_rocking)
    }

    /// Looks how far everything is; `nodes` must be up to date.
    #[inline(always)]
    pub(crate) fn look(
        &mut self,
        nodes: &[Node<V>],
        rope: &RopeLanes<V>,
        attach: &BaseState<V>,
        arm: &[BaseState<V>],
    ) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let mut speed = zero;
        for node in nodes {
            speed = speed.max(node.v.dot(node.v));
        }
        let speed = speed
            .sqrt()
            .fma(V::splat(1.5), V::splat(SPEED_ALLOWANCE_M_S));
        let travel = speed * self.max_step;
        let size = rope.link_length + self.lead_radius;
        let horizon = travel.fma(V::splat(LOOK_PERIOD as f64), size);
        self.reach = travel.fma(V::splat(4.0), size);
        self.imminent = zero;
        for (index, body) in self.bodies.iter_mut().enumerate() {
            body.follow(attach, arm);
            let mut least = V::splat(1e9);
            for node in nodes {
                least = least.min(body.distance(node.x).0);
            }
            self.near[index] = V::select_less(least, horizon, one, zero);
            self.engaged[index] = V::any_less(zero, self.near[index]);
        }
    }

    /// Adds the contacts' reactions at the predictions to `loads`.
    #[inline(always)]
    pub(crate) fn load(
        &mut self,
        loads: &mut [Load<V>],
        links: &[Link<V>],
        nodes: &[Node<V>],
        scheme: &Scheme<V>,
        attach: &BaseState<V>,
        arm: &[BaseState<V>],
    ) {
        let count = links.len();
        self.imminent = V::splat(0.0);
        if let Some(domino) = &mut self.domino
            && let Some(body) = self.bodies.last_mut()
        {
            body.frame = domino.predict(scheme.h);
        }
        for index in 0..self.bodies.len() {
            if !self.engaged[index] {
                continue;
            }
            self.bodies[index].follow(attach, arm);
            for link in 0..count {
                self.load_link(index, link, loads, links, nodes, scheme);
            }
        }
    }

    #[inline(always)]
    fn load_link(
        &mut self,
        index: usize,
        link: usize,
        loads: &mut [Load<V>],
        links: &[Link<V>],
        nodes: &[Node<V>],
        scheme: &Scheme<V>,
    ) {
        let zero = V::splat(0.0);
        let body = &self.bodies[index];
        let slot = index * links.len() + link;
        let (node, w, al) = (&nodes[link], links[link].w, links[link].al);
        let near = self.near[index];
        let close = V::select_less(body.distance(node.x).0, self.reach, near, zero);
        if !V::any_less(zero, close) {
            if !self.idle[slot] {
                self.touches[slot] = [Touch::none(); POINTS];
                self.idle[slot] = true;
            }
            return;
        }
        self.idle[slot] = false;
        let is_last = link + 1 == links.len();
        // Of a straight link above a plane an end is closest.
        let points = if body.shape == Shape::HalfSpace {
            1
        } else {
            POINTS
        };
        for which in 0..points {
            let touch = &mut self.touches[slot][which];
            let first = V::splat(link as f64 + 0.5);
            let point = if which == 0 {
                let (radius, stiffness) = if is_last {
                    (self.lead_radius, LEAD_STIFFNESS_N_M)
                } else {
                    (self.radius, LINK_STIFFNESS_N_M)
                };
                Point {
                    back: zero,
                    radius,
                    stiffness: V::splat(stiffness),
                    may_touch: V::select_less(body.first_node, first, close, zero),
                }
            } else {
                let far = step_back(node.x, node.v, body, scheme.h);
                let near = node.x.sub(node.span);
                let v_near = node.v.sub(w.cross_add(node.span, Vec3::zero()));
                let near = step_back(near, v_near, body, scheme.h);
                let (back, inside) = middle::closest(body, near, far);
                let may_touch = V::select_less(body.first_middle, first, close, zero);
                Point {
                    back,
                    radius: self.radius,
                    stiffness: V::splat(LINK_STIFFNESS_N_M),
                    may_touch: V::select_less(zero, inside, may_touch, zero),
                }
            };
            let about_to = touch.find(body, &point, node, w, scheme.h);
            self.imminent = self.imminent.max(about_to);
            let yielding = match &self.domino {
                Some(domino) if body.carrier == Carrier::Domino => {
                    touch.keep_where(domino.standing());
                    Some(domino.mobility(touch.normal(), touch.place(node)))
                }
                _ => None,
            };
            let reaction = touch.reaction(body.friction, node, al, scheme, yielding);
            loads[link] = loads[link].plus(&reaction);
        }
    }

    /// Takes in the motion the step has given. `end_s` and `running` are by lane.
    #[inline(always)]
    pub(crate) fn settle(
        &mut self,
        links: &[Link<V>],
        nodes: &[Node<V>],
        scheme: &Scheme<V>,
        lanes: &[StepEnd],
    ) {
        let count = links.len();
        for index in 0..self.bodies.len() {
            if !self.engaged[index] {
                continue;
            }
            let body = &self.bodies[index];
            let is_domino = body.carrier == Carrier::Domino;
            let mut tally = summary::Tally::none();
            for link in 0..count {
                let slot = index * count + link;
                if self.idle[slot] {
                    continue;
                }
                for (which, touch) in self.touches[slot].iter_mut().enumerate() {
                    let (force, at) = touch.settle(body, &nodes[link], links[link].w, scheme);
                    let is_lead = which == 0 && link + 1 == count;
                    tally.add(touch.force, touch.depth(), is_lead);
                    if is_domino && let Some(domino) = &mut self.domino {
                        domino.push(force, at);
                    }
                }
            }
            self.summaries.add(index, &tally, lanes);
        }
        if let Some(domino) = &mut self.domino {
            domino.advance(lanes);
        }
    }

    /// What one lane did with each obstacle.
    pub(crate) fn summaries_of(&self, lane: usize) -> Vec<ContactSummary> {
        let obstacles = self.bodies.len() - usize::from(self.domino.is_some());
        self.summaries.of(lane, obstacles)
    }

    /// What became of one lane's domino.
    pub(crate) fn domino_of(&self, lane: usize) -> Option<DominoOutcome> {
        let first = self.summaries.of(lane, self.bodies.len());
        let touched = first.last().and_then(|s| s.first).map(|(t, _)| t);
        self.domino.as_ref().map(|d| d.outcome(lane, touched))
    }
}

/// End of the current step in one lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepEnd {
    /// Time at its end, and its length (s).
    pub(crate) time_s: f64,
    pub(crate) step_s: f64,
    /// Whether the lane still counts.
    pub(crate) running: bool,
}

/// Where a point was at the start of the step, as the obstacle at its end sees it.
#[inline(always)]
fn step_back<V: Lanes>(x: Vec3<V>, v: Vec3<V>, body: &Body<V>, h: V) -> Vec3<V> {
    v.sub(body.frame.velocity_at(x)).scale_sub(h, x)
}
