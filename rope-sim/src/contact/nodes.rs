//! Where the rope's nodes are, how they move and how they are about to be accelerated.

use crate::algebra::Vec3;
use crate::clock::BaseState;
use crate::kernel::centripetal;
use crate::lanes::Lanes;
use crate::scheme::Scheme;
use crate::state::{Link, RopeLanes};

/// A link's farther node, with the way there from the nearer one.
#[derive(Clone, Copy)]
pub(crate) struct Node<V> {
    /// Position relative to the clock's origin (m).
    pub(crate) x: Vec3<V>,
    /// Velocity (m/s).
    pub(crate) v: Vec3<V>,
    /// Acceleration if every link keeps its last angular acceleration (m/s²).
    pub(crate) a: Vec3<V>,
    /// The link (m).
    pub(crate) span: Vec3<V>,
}

impl<V: Lanes> Node<V> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let none = Vec3::zero();
        Self {
            x: none,
            v: none,
            a: none,
            span: none,
        }
    }
}

/// The rope at the predictions.
#[derive(Clone, Copy)]
pub(crate) struct Predicted<'a, V> {
    pub(crate) links: &'a [Link<V>],
    pub(crate) nodes: &'a [Node<V>],
    /// Attach point relative to the clock's origin (m).
    pub(crate) attach: Vec3<V>,
    pub(crate) scheme: &'a Scheme<V>,
}

/// Nodes at the predictions; the links must have been predicted.
#[inline(always)]
pub(crate) fn predicted<V: Lanes>(
    nodes: &mut [Node<V>],
    links: &[Link<V>],
    rope: &RopeLanes<V>,
    base: &BaseState<V>,
    scheme: &Scheme<V>,
) {
    let (mut x, mut v, mut a) = (base.position, base.velocity, base.dynamics.a);
    for (node, link) in nodes.iter_mut().zip(links) {
        let span = link.q.down(rope.link_length);
        x = x.add(span);
        v = link.w.cross_add(span, v);
        a = link
            .al
            .cross_add(span, a.add(centripetal(link, span, scheme)));
        *node = Node { x, v, a, span };
    }
}

/// Positions and velocities after the step; accelerations stay.
#[inline(always)]
pub(crate) fn corrected<V: Lanes>(
    nodes: &mut [Node<V>],
    links: &[Link<V>],
    rope: &RopeLanes<V>,
    base: &BaseState<V>,
) {
    let (mut x, mut v) = (base.position, base.velocity);
    for (node, link) in nodes.iter_mut().zip(links) {
        let span = link.q.down(rope.link_length);
        x = x.add(span);
        v = link.w.cross_add(span, v);
        (node.x, node.v, node.span) = (x, v, span);
    }
}
