//! What rope and obstacles exchange in one step: forces before it, motion after it.

use super::body::Body;
use super::nodes::{Node, Predicted};
use super::summary::{StepEnd, note_touch};
use super::touch::{Point, Touch};
use super::{Contacts, POINTS, middle};
use crate::algebra::Vec3;
use crate::lanes::Lanes;
use crate::load::LinkLoads;
use crate::scene::Shape;
use crate::scheme::Scheme;
use crate::state::Link;

/// Stiffness of a link's surface (N/m): 0.01 mm under 1 N.
const LINK_STIFFNESS_N_M: f64 = 1e5;
/// Stiffness of a lead's surface (N/m): 120 g at 3 m/s push it in by less than 1 mm.
const LEAD_STIFFNESS_N_M: f64 = 2e6;
/// Index of a link's contact point at its farther node, and of that closest to the
/// obstacle.
const AT_NODE: usize = 0;
const BETWEEN: usize = 1;

impl<V: Lanes> Contacts<V> {
    /// Adds the contacts' reactions at the predictions to `loads`.
    #[inline(always)]
    pub(crate) fn load(&mut self, loads: &mut LinkLoads<V>, rope: Predicted<V>) {
        self.imminent = V::splat(0.0);
        if let Some(domino) = &mut self.domino
            && let Some(body) = self.bodies.last_mut()
            && let Some(frame) = domino.predict(rope.scheme.h)
        {
            body.frame = frame;
        }
        for index in 0..self.bodies.len() {
            if !self.engaged[index] {
                continue;
            }
            let mut nearer_m = self.bodies[index].distance(rope.attach).0;
            for link in 0..rope.links.len() {
                let farther_m = self.bodies[index].distance(rope.nodes[link].x).0;
                self.load_link(index, link, loads, rope, [nearer_m, farther_m]);
                nearer_m = farther_m;
            }
        }
    }

    /// `distances_m` are those of the link's two nodes.
    #[inline(always)]
    fn load_link(
        &mut self,
        index: usize,
        link: usize,
        loads: &mut LinkLoads<V>,
        rope: Predicted<V>,
        distances_m: [V; 2],
    ) {
        let slot = index * rope.links.len() + link;
        match self.point_at_node(index, link, rope, distances_m[1]) {
            Some(point) => self.press(index, (slot, AT_NODE), link, &point, loads, rope),
            None => self.release((slot, AT_NODE)),
        }
        match self.point_between(index, link, rope, distances_m) {
            Some(point) => self.press(index, (slot, BETWEEN), link, &point, loads, rope),
            None => self.release((slot, BETWEEN)),
        }
    }

    /// The link's farther node, if it is near a body in any lane.
    #[inline(always)]
    fn point_at_node(
        &self,
        index: usize,
        link: usize,
        rope: Predicted<V>,
        distance_m: V,
    ) -> Option<Point<V>> {
        let zero = V::splat(0.0);
        let (radius, stiffness) = if link + 1 == rope.links.len() {
            (self.lead_radius, LEAD_STIFFNESS_N_M)
        } else {
            (self.radius, LINK_STIFFNESS_N_M)
        };
        let close = V::select_less(distance_m, self.reach + radius, self.near[index], zero);
        if !V::any_less(zero, close) {
            return None;
        }
        Some(Point {
            back: zero,
            radius,
            stiffness: V::splat(stiffness),
            may_touch: close,
        })
    }

    /// The point of a link closest to a body, if that is near and between the nodes in
    /// any lane.
    #[inline(always)]
    fn point_between(
        &self,
        index: usize,
        link: usize,
        rope: Predicted<V>,
        distances_m: [V; 2],
    ) -> Option<Point<V>> {
        let zero = V::splat(0.0);
        let body = &self.bodies[index];
        // Of a straight link above a plane an end is closest.
        if body.shape == Shape::HalfSpace {
            return None;
        }
        // No point of the link is closer than half of what its ends' distances leave
        // beyond its length.
        let length_m = rope.nodes[link].span.norm();
        let least_m = (distances_m[0] + distances_m[1] - length_m) * V::splat(0.5);
        let reach_m = self.reach + self.radius;
        let close = V::select_less(least_m, reach_m, self.near[index], zero);
        if !V::any_less(zero, close) {
            return None;
        }
        let (back, inside) = closest_at_start(body, link, rope)?;
        Some(Point {
            back,
            radius: self.radius,
            stiffness: V::splat(LINK_STIFFNESS_N_M),
            may_touch: V::select_less(zero, inside, close, zero),
        })
    }

    /// Presses one point of a link against a body.
    #[inline(always)]
    fn press(
        &mut self,
        index: usize,
        (slot, which): (usize, usize),
        link: usize,
        point: &Point<V>,
        loads: &mut LinkLoads<V>,
        rope: Predicted<V>,
    ) {
        let (node, w, al) = (&rope.nodes[link], rope.links[link].w, rope.links[link].al);
        let body = &self.bodies[index];
        let touch = &mut self.touches[slot][which];
        self.idle[slot][which] = false;
        let about_to = touch.find(body, point, node, w, rope.scheme.h);
        self.imminent = self.imminent.max(about_to);
        let yielding = match &self.domino {
            Some(domino) if body.rocks => {
                touch.keep_where(domino.standing());
                Some(domino.yielding(touch.normal(), touch.place(node)))
            }
            _ => None,
        };
        if touch.is_active() {
            let reaction = touch.reaction(body.friction, node, al, rope.scheme, yielding);
            loads.add(link, &reaction);
        }
    }

    /// Lets one point of a link forget what it touched.
    #[inline(always)]
    fn release(&mut self, (slot, which): (usize, usize)) {
        if !self.idle[slot][which] {
            self.touches[slot][which] = Touch::none();
            self.idle[slot][which] = true;
        }
    }

    /// Takes in the motion the step has given. `lanes` are their ends of the step.
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
            let mut forces = [V::splat(0.0); 2];
            for link in 0..count {
                for which in 0..POINTS {
                    let slot = index * count + link;
                    if self.idle[slot][which] {
                        continue;
                    }
                    let touch = &mut self.touches[slot][which];
                    let (force, at) = touch.settle(body, &nodes[link], links[link].w, scheme);
                    let is_lead = which == AT_NODE && link + 1 == count;
                    let largest = &mut forces[usize::from(is_lead)];
                    *largest = largest.max(touch.force);
                    if body.rocks
                        && let Some(domino) = &mut self.domino
                    {
                        domino.push(force, at);
                    }
                }
            }
            note_touch(&mut self.summaries[index], forces, lanes);
        }
        if let Some(domino) = &mut self.domino {
            domino.advance(lanes);
        }
    }
}

/// Where a link came closest to a body at the start of the step, if anywhere between
/// its nodes in any lane, see [`middle::closest`].
#[inline(always)]
fn closest_at_start<V: Lanes>(body: &Body<V>, link: usize, rope: Predicted<V>) -> Option<(V, V)> {
    let (node, w, h) = (&rope.nodes[link], rope.links[link].w, rope.scheme.h);
    let far = step_back(node.x, node.v, body, h);
    let near = node.x.sub(node.span);
    let v_near = node.v.sub(w.cross_add(node.span, Vec3::zero()));
    let near = step_back(near, v_near, body, h);
    middle::closest(body, near, far)
}

/// Where a point was at the start of the step, as the obstacle at its end sees it.
#[inline(always)]
fn step_back<V: Lanes>(x: Vec3<V>, v: Vec3<V>, body: &Body<V>, h: V) -> Vec3<V> {
    v.sub(body.frame.velocity_at(x)).scale_sub(h, x)
}
