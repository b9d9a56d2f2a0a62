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
mod exchange;
mod middle;
mod nodes;
mod rocking;
mod shape;
mod start;
mod summary;
mod touch;

pub(crate) use nodes::{Node, Predicted, corrected, predicted};
pub(crate) use start::check_start;
pub(crate) use summary::StepEnd;

use crate::lanes::Lanes;
use crate::scene::{ContactSummary, DominoOutcome, Scene};
use crate::state::RopeLanes;
use body::Body;
use rocking::RockingBlocks;
use shared_types::RopeParams;
use touch::{RETARDATION_S, Touch};

/// Steps between two looks at how far everything is.
pub(crate) const LOOK_PERIOD: usize = 8;
/// What nodes and obstacles may gain in speed between two looks (m/s), above half as
/// much again as the fastest node.
const SPEED_ALLOWANCE_M_S: f64 = 12.0;
/// Steps a node could travel in, if it came as close as that it would be looked at.
const REACH_STEPS: f64 = 4.0;
/// Contact points of a link: farther node, closest point.
const POINTS: usize = 2;

/// All contacts of a group of ropes.
#[derive(Clone)]
pub(crate) struct Contacts<V> {
    bodies: Vec<Body<V>>,
    /// By body, link, point.
    touches: Vec<[Touch<V>; POINTS]>,
    /// Whether a point is as if never touched, in all lanes.
    idle: Vec<[bool; POINTS]>,
    /// Per body, positive in lanes that are near.
    near: Vec<V>,
    engaged: Vec<bool>,
    /// How close a point of the rope must be to be looked at, less its radius (m).
    reach: V,
    radius: V,
    lead_radius: V,
    max_step: V,
    /// Positive in lanes that are about to touch.
    pub(crate) imminent: V,
    domino: Option<RockingBlocks<V>>,
    /// By body, then lane.
    summaries: Vec<Vec<ContactSummary>>,
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
        let links = ropes.first().map_or(0, |r| r.links as usize);
        let mut bodies: Vec<Body<V>> = scene
            .obstacles
            .iter()
            .map(|o| Body::new(o, origin_m))
            .collect();
        let mut radius = V::splat(0.0);
        let mut lead_radius = radius;
        for lane in 0..V::COUNT {
            let Some(rope) = ropes.get(lane).or_else(|| ropes.last()) else {
                continue;
            };
            radius.set(lane, rope.radius_m);
            lead_radius.set(lane, rope.lead_radius_m.max(rope.radius_m));
        }
        let domino = scene
            .domino
            .as_ref()
            .map(|d| RockingBlocks::new(d, ropes.len(), origin_m));
        bodies.extend(domino.as_ref().map(RockingBlocks::body));
        let count = bodies.len();
        Self {
            touches: vec![[Touch::none(); POINTS]; count * links],
            idle: vec![[true; POINTS]; count * links],
            near: vec![V::splat(0.0); count],
            engaged: vec![false; count],
            summaries: vec![vec![ContactSummary::default(); ropes.len()]; count],
            bodies,
            reach: V::splat(0.0),
            radius,
            lead_radius,
            // Contacts act on what is through the surface that much later.
            max_step: V::splat(max_step_s.max(RETARDATION_S)),
            imminent: V::splat(0.0),
            domino,
        }
    }

    /// Whether anything may be touched before the next look.
    pub(crate) fn is_engaged(&self) -> bool {
        self.engaged.contains(&true) || self.domino.as_ref().is_some_and(RockingBlocks::is_rocking)
    }

    /// Looks how far everything is; `nodes` must be up to date.
    #[inline(always)]
    pub(crate) fn look(&mut self, nodes: &[Node<V>], rope: &RopeLanes<V>) {
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
        self.reach = travel * V::splat(REACH_STEPS);
        self.imminent = zero;
        for (index, body) in self.bodies.iter().enumerate() {
            let mut least = V::splat(1e9);
            for node in nodes {
                least = least.min(body.distance(node.x).0);
            }
            self.near[index] = V::select_less(least, horizon, one, zero);
            self.engaged[index] = V::any_less(zero, self.near[index]);
        }
    }

    /// What one lane did with each obstacle.
    pub(crate) fn summaries_of(&self, lane: usize) -> Vec<ContactSummary> {
        let obstacles = self.bodies.len() - usize::from(self.domino.is_some());
        let of_obstacles = self.summaries.iter().take(obstacles);
        of_obstacles.map(|by_lane| by_lane[lane]).collect()
    }

    /// Tilt of one lane's domino (rad).
    pub(crate) fn tilt_rad_of(&self, lane: usize) -> Option<f64> {
        self.domino.as_ref().map(|d| d.tilt_rad(lane))
    }

    /// What became of one lane's domino.
    pub(crate) fn domino_of(&self, lane: usize) -> Option<DominoOutcome> {
        self.domino.as_ref().map(|d| d.outcome(lane))
    }
}
