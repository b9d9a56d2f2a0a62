//! One point of the rope against one obstacle.
//!
//! The normal force is `k (depth + tau d/dt depth)+` at the end of the step: a stiff
//! spring so damped that the contact is inelastic. A tau shorter than the spring's own
//! time would let it bounce, so it does not shrink with steps shorter than those of
//! throws. The force acts already before the surface is reached, on whatever would be
//! through it tau later, so that speed alone cannot carry a point through. The step
//! solves for the force and the motion together: whatever the stiffness, the matrix
//! stays positive.
//!
//! The surface is replaced by its tangent plane where the point's path of this step
//! first meets it; the path is followed from outside in strides of the distance left.
//!
//! Friction is a spring along the surface, anchored where the point began to stick,
//! whose force is cut to the friction coefficient times the normal force of the step
//! before, and whose anchor is then dragged along: at rest it does not creep. It acts for
//! a step longer than the contact pushes, so that a short impact has friction, too.

use super::body::Body;
use super::nodes::Node;
use crate::algebra::{Sym3, Vec3};
use crate::lanes::Lanes;
use crate::load::Load;
use crate::scene::Shape;
use crate::scheme::Scheme;

/// Strides along the path of one step.
const STRIDES: usize = 4;
/// Gap that a rope approaching an obstacle may have at the start of a step without
/// forgetting its accelerations (m).
const IMMINENT_M: f64 = 5e-4;
/// Least retardation tau (s): the step of throws.
pub(super) const RETARDATION_S: f64 = 5e-4;
/// Stiffness along the surface, as part of that across it.
const TANGENTIAL_PART: f64 = 0.1;
/// Lengths and speeds below which a direction has no meaning.
const TINY: f64 = 1e-12;

/// The retardation tau of steps of `h` (s).
#[inline(always)]
fn retardation<V: Lanes>(h: V) -> V {
    h.max(V::splat(RETARDATION_S))
}

/// Memory of one contact point, and what the step must know about it.
#[derive(Clone, Copy)]
pub(crate) struct Touch<V> {
    /// Last normal force (N); 0 out of contact.
    pub(crate) force: V,
    /// Spring along the surface (m).
    stretch: Vec3<V>,
    normal: Vec3<V>,
    /// Place on the link, from the farther node back (1).
    back: V,
    /// From that place to the surface of the rope (m).
    surface: Vec3<V>,
    /// Predicted gap (m) and velocity against the obstacle (m/s).
    gap: V,
    velocity: Vec3<V>,
    /// Stiffness where the contact is active, else 0 (N/m).
    stiffness: V,
    /// Stiffness along the surface, active or not (N/m).
    along: V,
    /// Force on the rope while it moves as predicted (N), and by how much less it is per
    /// acceleration beyond that (kg).
    push: Vec3<V>,
    resistance: Sym3<V>,
}

/// How an obstacle that turns about an axis yields to a force on its surface.
#[derive(Clone, Copy)]
pub(crate) struct Yielding<V> {
    /// Velocity of the place that is pushed, per rate of the turn that the obstacle is free to
    /// make (m).
    pub(crate) lever: Vec3<V>,
    /// Inverse of the inertia about the axis, with the place's share of all contacts
    /// (1/(kg m²)).
    pub(crate) mobility: V,
    /// Positive where it can turn in that sense only.
    pub(crate) one_sided: V,
}

/// What a contact point is part of.
pub(crate) struct Point<V> {
    /// Place on the link, from the farther node back (1).
    pub(crate) back: V,
    /// Radius of the rope, or of the lead (m).
    pub(crate) radius: V,
    /// Stiffness of its surface (N/m).
    pub(crate) stiffness: V,
    /// Positive in lanes that may touch.
    pub(crate) may_touch: V,
}

impl<V: Lanes> Touch<V> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        let (zero, none) = (V::splat(0.0), Vec3::zero());
        Self {
            force: zero,
            stretch: none,
            normal: none,
            back: zero,
            surface: none,
            gap: zero,
            velocity: none,
            stiffness: zero,
            along: zero,
            push: none,
            resistance: Sym3::diagonal(zero),
        }
    }

    /// Finds the contact plane for this step. The result is positive in lanes where
    /// the point is about to touch.
    #[inline(always)]
    pub(crate) fn find(
        &mut self,
        body: &Body<V>,
        point: &Point<V>,
        node: &Node<V>,
        w: Vec3<V>,
        h: V,
    ) -> V {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let arm = node.span.scale(-point.back);
        let x = node.x.add(arm);
        let v = w.cross_add(arm, node.v);
        let path = v.sub(body.frame.velocity_at(x)).scale(h);
        let start = x.sub(path);
        let per_length = path.norm().max(V::splat(TINY)).recip();
        let mut done = zero;
        // A plane is its own tangent plane.
        let strides = if body.shape == Shape::HalfSpace {
            0
        } else {
            STRIDES
        };
        let mut stride = 0;
        let (gap, normal) = loop {
            let at = path.scale_add(done, start);
            let (distance, normal) = body.distance(at);
            let gap = distance - point.radius;
            if stride == strides {
                // On to the end of the path, along the tangent plane.
                break (normal.dot(path).fma(one - done, gap), normal);
            }
            done = gap.max(zero).fma(per_length, done).min(one);
            stride += 1;
        };
        self.normal = normal;
        self.back = point.back;
        self.surface = normal.scale(-point.radius);
        let at_surface = arm.add(self.surface);
        let v_surface = w.cross_add(at_surface, node.v);
        self.velocity = v_surface.sub(body.frame.velocity_at(x.add(self.surface)));
        self.gap = gap;
        let rate = normal.dot(self.velocity);
        let tau = retardation(h);
        let ahead = rate.fma(tau, gap);
        let stiffness = V::select_less(zero, point.may_touch, point.stiffness, zero);
        self.stiffness = V::select_less(ahead, zero, stiffness, zero);
        self.along = stiffness * V::splat(TANGENTIAL_PART);
        (self.push, self.resistance) = (Vec3::zero(), Sym3::diagonal(zero));
        let later = rate.fma(tau + h + h, gap);
        let imminent = V::select_less(later, V::splat(IMMINENT_M), one, zero);
        V::select_less(zero, point.may_touch, imminent, zero)
    }

    /// Whether it pushes or rubs in any lane.
    #[inline(always)]
    pub(crate) fn is_active(&self) -> bool {
        V::any_less(V::splat(0.0), self.stiffness.max(self.force))
    }

    /// The force on the link, as the step needs it.
    #[inline(always)]
    pub(crate) fn reaction(
        &mut self,
        friction: V,
        node: &Node<V>,
        al: Vec3<V>,
        scheme: &Scheme<V>,
        yielding: Option<Yielding<V>>,
    ) -> Load<V> {
        let one = V::splat(1.0);
        let (h, tau) = (scheme.h, retardation(scheme.h));
        let n = self.normal;
        let rate = n.dot(self.velocity);
        let shift = scheme.correct_half_phi + scheme.correct_half_phi;
        let normal_resistance = self.stiffness * scheme.correct_w.fma(tau, shift);
        let push = -self.stiffness * rate.fma(tau, self.gap);

        let slide = n.scale_sub(rate, self.velocity);
        let stretch = self.stretch;
        let stretch = n.scale_sub(n.dot(stretch), stretch);
        let along = self.along;
        let pull = slide.scale_add(h + tau, stretch).scale(along);
        let limit = friction * self.force;
        let grip = (limit * pull.norm().max(V::splat(TINY)).recip()).min(one);
        let tangential_resistance = grip * along * scheme.correct_w * (h + tau);

        self.push = n.scale_add(push, pull.scale(-grip));
        self.resistance = Sym3::diagonal(tangential_resistance)
            .plus_outer(normal_resistance - tangential_resistance, n);
        if let Some(yielding) = yielding {
            self.yield_as(&yielding, scheme);
        }
        let arm = self.surface.add(node.span.scale(-self.back));
        Load::push(self.push, self.resistance, arm, al.cross_add(arm, node.a))
    }

    /// The obstacle gives way within the step, along the surface as well as across it: its turn
    /// is one more unknown, which Sherman and Morrison's formula eliminates.
    #[inline(always)]
    fn yield_as(&mut self, yielding: &Yielding<V>, scheme: &Scheme<V>) {
        let (zero, one) = (V::splat(0.0), V::splat(1.0));
        let turning = -yielding.lever.dot(self.push);
        let blocked = V::select_less(zero, turning, zero, yielding.one_sided);
        let mobility = yielding.mobility * scheme.h * scheme.correct_w.recip();
        let mobility = V::select_less(zero, blocked, zero, mobility);
        let resisted = self.resistance.times_add(yielding.lever, Vec3::zero());
        let part = mobility * yielding.lever.dot(resisted).fma(mobility, one).recip();
        self.push = resisted.scale_add(part * turning, self.push);
        self.resistance = self.resistance.plus_outer(-part, resisted);
    }

    /// Takes in the motion the step has given: normal force, anchor. Gives the force
    /// on the rope (N) and where it acts, relative to the clock's origin (m). A pull, which
    /// the step may have solved for where the point leaves, is not passed on.
    #[inline(always)]
    pub(crate) fn settle(
        &mut self,
        body: &Body<V>,
        node: &Node<V>,
        w: Vec3<V>,
        scheme: &Scheme<V>,
    ) -> (Vec3<V>, Vec3<V>) {
        let zero = V::splat(0.0);
        let h = scheme.h;
        let n = self.normal;
        let arm = self.surface.add(node.span.scale(-self.back));
        let x = node.x.add(arm);
        let v = w.cross_add(arm, node.v).sub(body.frame.velocity_at(x));
        let beyond = v.sub(self.velocity).scale(-scheme.correct_w.recip());
        let on_rope = self.resistance.times_add(beyond, self.push);
        let force = n.dot(on_rope).max(zero);
        // Where it pushes no longer, it may have rubbed for one more step.
        let rubbed = V::select_less(zero, self.stiffness, zero, self.force);
        self.force = V::select_less(zero, self.stiffness, force, zero);
        let acted = self.force.max(rubbed);
        let on_rope = Vec3::select_less(zero, acted, on_rope, Vec3::zero());

        let slide = n.scale_sub(n.dot(v), v);
        let stretch = n.scale_sub(n.dot(self.stretch), self.stretch);
        let stretch = slide.scale_add(h, stretch);
        let along = self.along;
        let pull = along * stretch.norm();
        let limit = body.friction * self.force;
        let grip = (limit * pull.max(V::splat(TINY)).recip()).min(V::splat(1.0));
        self.stretch = Vec3::select_less(zero, self.force, stretch.scale(grip), Vec3::zero());
        (on_rope, x)
    }

    /// Lets the contact be where `standing` is positive only.
    #[inline(always)]
    pub(crate) fn keep_where(&mut self, standing: V) {
        let zero = V::splat(0.0);
        self.stiffness = V::select_less(zero, standing, self.stiffness, zero);
        self.along = V::select_less(zero, standing, self.along, zero);
    }

    /// Where on the rope's surface it is, relative to the clock's origin (m).
    #[inline(always)]
    pub(crate) fn place(&self, node: &Node<V>) -> Vec3<V> {
        node.x.add(self.surface).add(node.span.scale(-self.back))
    }

    /// The outward normal.
    #[inline(always)]
    pub(crate) fn normal(&self) -> Vec3<V> {
        self.normal
    }
}
