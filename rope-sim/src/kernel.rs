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

use crate::algebra::{Mat3, Quat, Sym3, Vec3};
use crate::lanes::Lanes;
use crate::load::{Load, Loads};
use crate::scheme::Scheme;
use crate::state::{BaseLanes, Link, RopeLanes};

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

/// What a step tells about itself.
pub(crate) struct StepReport<V> {
    /// Lead relative to node 0 (m).
    pub(crate) tip: Vec3<V>,
    /// Its velocity relative to node 0's (m/s).
    pub(crate) tip_velocity: Vec3<V>,
    /// Smallest |cos| of half a joint angle, at the predictions.
    pub(crate) min_half_cos: V,
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
    let min_half_cos = eliminate(links, scratch, rope, base, scheme, loads);
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
    StepReport {
        tip,
        tip_velocity,
        min_half_cos,
    }
}

/// Sweep from the lead to the attach point; returns the smallest |cos| of half a
/// joint angle.
#[inline(always)]
fn eliminate<V: Lanes, L: Loads<V>>(
    links: &mut [Link<V>],
    scratch: &mut [Elimination<V>],
    rope: &RopeLanes<V>,
    base: &BaseLanes<V>,
    scheme: &Scheme<V>,
    loads: &L,
) -> V {
    let mut beyond = Beyond::lead(rope);
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
            beyond.add(load, rope.per_resistance);
        }
        let half = beyond.open(rope, joints.span, link.al_change);
        joints.prepare(links_nearer, spaces_nearer, rope, scheme, loads);
        beyond.close(rope, space, &half);
        nearer = links_nearer;
        spaces = spaces_nearer;
    }
    joints.min_half_cos
}

/// What a joint feels of one of the bodies it joins.
#[derive(Clone, Copy)]
struct Ends<V> {
    q: Quat<V>,
    /// `al - c w`: acceleration guess and damping, whose difference over the joint
    /// is a part of its torque.
    pull: Vec3<V>,
}

impl<V: Lanes> Ends<V> {
    #[inline(always)]
    fn of(link: &Link<V>, rope: &RopeLanes<V>) -> Self {
        Self {
            q: link.q,
            pull: link.w.scale_sub(rope.damping, link.al),
        }
    }
}

/// Joint by joint towards the attach point: predictions and torques.
struct Joints<V> {
    base: Ends<V>,
    /// Of the link whose joint comes next.
    child: Ends<V>,
    /// Of the link prepared last (m).
    span: Vec3<V>,
    min_half_cos: V,
}

impl<V: Lanes> Joints<V> {
    #[inline(always)]
    fn new(base: &BaseLanes<V>, rope: &RopeLanes<V>) -> Self {
        let base = Ends {
            q: base.q,
            pull: base.w.scale_sub(rope.damping, base.alpha),
        };
        Self {
            base,
            child: base,
            span: Vec3::zero(),
            min_half_cos: V::splat(1.0),
        }
    }

    /// Fills in what the elimination of the last of `links`, already predicted, needs,
    /// and predicts the link before it. The centripetal acceleration takes the place
    /// of the acceleration change, which nothing needs any more: with a vector less
    /// each, the links of a rope stay in the fastest cache.
    #[inline(always)]
    fn prepare<L: Loads<V>>(
        &mut self,
        links: &mut [Link<V>],
        scratch: &mut [Elimination<V>],
        rope: &RopeLanes<V>,
        scheme: &Scheme<V>,
        loads: &L,
    ) {
        let (Some((link, nearer)), Some(space)) = (links.split_last_mut(), scratch.last_mut())
        else {
            return;
        };
        self.span = link.q.down(rope.link_length);
        link.al_change = centripetal(link, self.span, scheme);
        let parent = match nearer.last_mut() {
            Some(parent) => {
                if !L::PRESENT {
                    parent.predict(scheme);
                }
                Ends::of(parent, rope)
            }
            None => self.base,
        };
        let turn = if L::PRESENT {
            self.child.q.times_conj(parent.q.times(loads.rest_turn()))
        } else {
            self.child.q.times_conj(parent.q)
        };
        self.min_half_cos = self.min_half_cos.min(turn.w.abs());
        let pull = self.child.pull.sub(parent.pull);
        space.y = turn.v.scale_sub(spring(rope, turn.w), pull);
        self.child = parent;
    }
}

/// Stiffness times joint angle over the sine of the half angle: a polynomial in
/// `1 - |cos|` of the half angle; the sign picks the rotation of at most half a turn.
#[inline(always)]
fn spring<V: Lanes>(rope: &RopeLanes<V>, half_cos: V) -> V {
    let x = V::splat(1.0) - half_cos.abs();
    let mut f = V::splat(0.0);
    let mut first = true;
    let mut power = V::ANGLE_POLYNOMIAL.len();
    while power > 0 {
        power -= 1;
        let coefficient = V::splat(V::ANGLE_POLYNOMIAL[power]);
        f = if first {
            coefficient
        } else {
            f.fma(x, coefficient)
        };
        first = false;
    }
    (f * rope.stiffness).flip_by(half_cos)
}

/// `w x (w x span)` (m/s²) at the extrapolated velocity: the predicted one carries the
/// dominant error of the single linear solve.
#[inline(always)]
pub(crate) fn centripetal<V: Lanes>(link: &Link<V>, span: Vec3<V>, scheme: &Scheme<V>) -> Vec3<V> {
    let w = link.al_change.scale_add(scheme.centripetal, link.w);
    span.scale_sub(w.dot(w), w.scale(w.dot(span)))
}

/// Reaction of everything beyond node i on link i, for an acceleration `a` of the
/// node and the angular acceleration `alpha` of the link: `force = vv a + vw alpha +
/// bv`, `torque = vw^T a + ww alpha + bw`.
struct Beyond<V> {
    /// `vv` and half the mass of the link.
    vv_link: Sym3<V>,
    vw: Mat3<V>,
    /// Identity minus `ww`.
    one_less_ww: Sym3<V>,
    /// `bv` and half the weight of the link.
    bv_link: Vec3<V>,
    bw: Vec3<V>,
}

/// A link's elimination up to the division.
struct HalfEliminated<V> {
    v: Mat3<V>,
    /// Cofactors of the matrix to invert, and the inverse of its determinant.
    cofactors: Sym3<V>,
    per_determinant: V,
    /// `vv cent + bv` with half the link's own share, and its torque.
    force: Vec3<V>,
    bw: Vec3<V>,
}

impl<V: Lanes> Beyond<V> {
    /// Adds what touches the link, in units of the joint resistance.
    #[inline(always)]
    fn add(&mut self, load: &Load<V>, per_resistance: V) {
        let u = per_resistance;
        self.vv_link = load.vv.scale(u).add(self.vv_link);
        self.vw = load.vw.scale(u).add(&self.vw);
        self.one_less_ww = load.ww.scale(-u).add(self.one_less_ww);
        self.bv_link = load.bv.scale_add(u, self.bv_link);
        self.bw = load.bw.scale_add(u, self.bw);
    }

    #[inline(always)]
    fn lead(rope: &RopeLanes<V>) -> Self {
        let half = V::splat(0.5);
        Self {
            vv_link: Sym3::diagonal(rope.link_mass.fma(half, rope.lead_mass)),
            vw: Mat3::zero(),
            one_less_ww: Sym3::diagonal(V::splat(1.0) - rope.lead_inertia),
            bv_link: up().scale(rope.link_mass.fma(half, rope.lead_mass)),
            bw: Vec3::zero(),
        }
    }

    /// First half of the elimination of a predicted link.
    #[inline(always)]
    fn open(&self, rope: &RopeLanes<V>, span: Vec3<V>, centripetal: Vec3<V>) -> HalfEliminated<V> {
        let quarter_mass = rope.link_mass * V::splat(0.25);
        // Coupling of the nearer node's acceleration with this link's rotation.
        let p = self.vv_link.rows();
        let v = Mat3([
            span.cross_add(p[0], self.vw.0[0]),
            span.cross_add(p[1], self.vw.0[1]),
            span.cross_add(p[2], self.vw.0[2]),
        ]);
        let s = self.rotation_matrix(span, &v, rope, quarter_mass);
        let (cofactors, determinant) = s.cofactors();
        let per_determinant = determinant.recip();

        let force = self.vv_link.times_add(centripetal, self.bv_link);
        let at_centre = centripetal.scale_sub(quarter_mass, force);
        let bw = span.cross_add(at_centre, self.vw.transpose_times_add(centripetal, self.bw));
        HalfEliminated {
            v,
            cofactors,
            per_determinant,
            force,
            bw,
        }
    }

    /// Second half: afterwards `self` is seen from the link's nearer node.
    #[inline(always)]
    fn close(&mut self, rope: &RopeLanes<V>, space: &mut Elimination<V>, half: &HalfEliminated<V>) {
        let v = &half.v;
        let s_inv = half.cofactors.scale(half.per_determinant);
        let x = Mat3([
            s_inv.times(v.0[0]),
            s_inv.times(v.0[1]),
            s_inv.times(v.0[2]),
        ]);
        self.vv_link = self
            .vv_link
            .plus_diagonal(rope.link_mass)
            .minus_product_transposed(&x, v);
        let torque = space.y;
        let y = s_inv.times(torque.sub(half.bw));
        self.vw = x;
        self.one_less_ww = s_inv;
        let weight = up().scale(rope.link_mass);
        self.bv_link = v.times_add(y, half.force.add(weight));
        self.bw = torque.sub(y);
        space.s_inv = s_inv;
        space.y = y;
        space.x = x;
    }

    /// Torque per angular acceleration of the link about its nearer node; symmetric
    /// and positive definite for any step.
    #[inline(always)]
    fn rotation_matrix(
        &self,
        span: Vec3<V>,
        v: &Mat3<V>,
        rope: &RopeLanes<V>,
        quarter_mass: V,
    ) -> Sym3<V> {
        // The joint's resistance on both sides, itself 1, the link's own inertia.
        let own = rope.link_inertia + V::splat(2.0);
        let diagonal = (quarter_mass * rope.link_length).fnma(rope.link_length, own);
        let n = &self.one_less_ww;
        let Vec3(x, y, z) = span;
        let Vec3(mx, my, mz) = span.scale(quarter_mass);
        let [v0, v1, v2] = v.0;
        let [a0, a1, a2] = self.vw.0;
        let xx = mx.fma(x, diagonal - n.xx);
        let xy = mx.fma(y, -n.xy);
        let xz = mx.fma(z, -n.xz);
        let yy = my.fma(y, diagonal - n.yy);
        let yz = my.fma(z, -n.yz);
        let zz = mz.fma(z, diagonal - n.zz);
        // [span]x V + ([span]x vw)^T, upper half.
        Sym3 {
            xx: y.fma(v2.0 + a2.0, z.fnma(v1.0 + a1.0, xx)),
            xy: y.fma(v2.1, z.fnma(v1.1, z.fma(a0.0, x.fnma(a2.0, xy)))),
            xz: y.fma(v2.2, z.fnma(v1.2, x.fma(a1.0, y.fnma(a0.0, xz)))),
            yy: z.fma(v0.1 + a0.1, x.fnma(v2.1 + a2.1, yy)),
            yz: z.fma(v0.2, x.fnma(v2.2, x.fma(a1.1, y.fnma(a0.1, yz)))),
            zz: x.fma(v1.2 + a1.2, y.fnma(v0.2 + a0.2, zz)),
        }
    }
}

/// Acceleration that holds up against gravity and the side push (m/s²).
#[inline(always)]
fn up<V: Lanes>() -> Vec3<V> {
    let push = -side_push_m_s2::<V>();
    Vec3::splat(push, push, GRAVITY_M_S2)
}
