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
mod link;
mod outboard;

pub(crate) use joints::spring;
pub use link::GRAVITY_M_S2;
pub(crate) use link::{Elimination, centripetal, up};

use crate::algebra::Vec3;
use crate::lanes::Lanes;
use crate::load::Loads;
use crate::scheme::Scheme;
use crate::state::{BaseLanes, Link, RopeLanes};
use joints::{Ends, Joints};
use outboard::Outboard;

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
