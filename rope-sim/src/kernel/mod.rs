//! One time step of a group of ropes: articulated elimination over the links,
//! fused with the predictor (sweep towards the attach point) and the corrector
//! (sweep towards the lead).
//!
//! The state holds attitudes and angular velocities only; nodes follow from
//! `x_{i+1} = x_i + s d_i`, so links cannot stretch and nothing drifts. With
//! isotropic link inertia no rotation matrix enters the dynamics. Joints have
//! three degrees of freedom: twist is part of the model.
//!
//! Per link the unknown is its exact angular acceleration `alpha`; the joint's
//! spring and damper are implicit (linearised once) through the joint resistance,
//! see [`crate::scheme`]. Only ratios of stiffness, damping and masses act on the
//! motion, so masses, torques and forces are in units of the joint resistance
//! ([`RopeLanes::set`]), which is then 1 and drops out.
//!
//! The elimination is one long chain of dependent operations from link to link. What
//! does not hang on it (prediction and joint torque of the next link) is written
//! between the halves of the elimination of a link, where the processor would
//! otherwise wait for a division.

mod joints;
mod outboard;

use crate::algebra::{Mat3, Sym3, Vec3};
use crate::lanes::Lanes;
use crate::load::Loads;
use crate::scheme::Scheme;
use crate::state::{BaseLanes, Link, RopeLanes};
use joints::{Ends, Joints};
use outboard::Outboard;

/// Standard gravity of the model (m/s²), along -z.
pub(crate) const GRAVITY_M_S2: f64 = 9.81;

/// A push along +x and +y (m/s²), in single precision only. Seven orders of
/// magnitude below gravity, it moves a tip by less than a tenth of a micrometre,
/// and keeps the components out of a planar motion's plane from decaying into
/// denormal numbers, which would halve the speed.
const fn side_push_m_s2<V: Lanes>() -> f64 {
    if V::IS_SINGLE { 1e-6 } else { 0.0 }
}

/// What the first sweep leaves for the second, per link:
/// `alpha = s_inv alpha_parent + y - x^T a_parent`.
#[derive(Clone, Copy)]
pub(crate) struct Elimination<V> {
    s_inv: Sym3<V>,
    /// Holds the joint torque until the link is eliminated.
    y: Vec3<V>,
    x: Mat3<V>,
}

impl<V: Lanes> Elimination<V> {
    /// Scratch space before its first use.
    #[inline(always)]
    pub(crate) fn empty() -> Self {
        Self {
            s_inv: Sym3::diagonal(V::splat(0.0)),
            y: Vec3::zero(),
            x: Mat3::zero(),
        }
    }
}

/// What a step reports.
pub(crate) struct StepReport<V> {
    /// Lead relative to node 0 (m).
    pub(crate) tip: Vec3<V>,
    /// Its velocity relative to node 0's (m/s).
    pub(crate) tip_velocity: Vec3<V>,
}

/// Advances every lane by one step.
#[inline(always)]
pub(crate) fn step<V: Lanes, L: Loads<V>>(
    links: &mut [Link<V>],
    scratch: &mut [Elimination<V>],
    rope: &RopeLanes<V>,
    base: &BaseLanes<V>,
    scheme: &Scheme<V>,
    loads: &L,
) -> StepReport<V> {
    eliminate(links, scratch, rope, base, scheme, loads);
    let mut acceleration = base.a;
    let mut alpha = base.alpha;
    let mut tip = Vec3::zero();
    let mut tip_velocity = Vec3::zero();
    for (link, e) in links.iter_mut().zip(scratch.iter()) {
        let free = e.s_inv.times_add(alpha, e.y);
        alpha = e.x.transpose_times_sub(acceleration, free);
        let predicted_span = link.q.down(rope.link_length);
        let centripetal = link.al_change;
        acceleration = alpha.cross_add(predicted_span, acceleration.add(centripetal));
        link.correct(scheme, alpha);
        let span = link.q.down(rope.link_length);
        tip = tip.add(span);
        tip_velocity = link.w.cross_add(span, tip_velocity);
    }
    StepReport { tip, tip_velocity }
}

/// Sweep from the lead to the attach point.
#[inline(always)]
fn eliminate<V: Lanes, L: Loads<V>>(
    links: &mut [Link<V>],
    scratch: &mut [Elimination<V>],
    rope: &RopeLanes<V>,
    base: &BaseLanes<V>,
    scheme: &Scheme<V>,
    loads: &L,
) {
    let mut outboard = Outboard::lead(rope);
    let mut joints = Joints::new(base, rope);
    if let Some(last) = links.last_mut() {
        if !L::PRESENT {
            last.predict(scheme);
        }
        joints.child = Ends::of(last, rope);
    }
    joints.prepare(links, scratch, rope, scheme, loads);
    let mut nearer = links;
    let mut spaces = scratch;
    while let (Some((link, links_nearer)), Some((space, spaces_nearer))) =
        (nearer.split_last_mut(), spaces.split_last_mut())
    {
        if let Some(load) = loads.on_link(links_nearer.len()) {
            outboard.add(load, rope.per_resistance);
        }
        let half = outboard.open(rope, joints.span, link.al_change);
        joints.prepare(links_nearer, spaces_nearer, rope, scheme, loads);
        outboard.close(rope, space, &half);
        nearer = links_nearer;
        spaces = spaces_nearer;
    }
}

/// `w x (w x span)` (m/s²) at the extrapolated velocity: the predicted one carries the
/// dominant error of the single linear solve.
#[inline(always)]
pub(crate) fn centripetal<V: Lanes>(link: &Link<V>, span: Vec3<V>, scheme: &Scheme<V>) -> Vec3<V> {
    let w = link.al_change.scale_add(scheme.centripetal, link.w);
    span.scale_sub(w.dot(w), w.scale(w.dot(span)))
}

/// Acceleration that holds up against gravity and the side push (m/s²).
#[inline(always)]
pub(crate) fn up<V: Lanes>() -> Vec3<V> {
    let push = -side_push_m_s2::<V>();
    Vec3::splat(push, push, GRAVITY_M_S2)
}
