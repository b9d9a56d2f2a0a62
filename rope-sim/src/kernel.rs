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
//! spring and damper are implicit (linearised once) through `kappa`, see
//! [`crate::scheme`]. Everything beyond node i acts on link i as
//! `force = vv a + vw alpha + bv`, `torque = vw^T a + ww alpha + bw` for an
//! acceleration `a` of node i.

use crate::algebra::{Mat3, Quat, Sym3, Vec3};
use crate::lanes::Lanes;
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

/// What the first sweep leaves for the second, per link.
#[derive(Clone, Copy)]
pub(crate) struct Elimination<V> {
    s_inv: Sym3<V>,
    y: Vec3<V>,
    x: Mat3<V>,
    span: Vec3<V>,
    centripetal: Vec3<V>,
}

impl<V: Lanes> Elimination<V> {
    /// Scratch space before its first use.
    #[inline(always)]
    pub(crate) fn empty() -> Self {
        Self {
            s_inv: Sym3::diagonal(V::splat(0.0)),
            y: Vec3::zero(),
            x: Mat3::zero(),
            span: Vec3::zero(),
            centripetal: Vec3::zero(),
        }
    }
}

/// Reaction of everything beyond a node.
struct Beyond<V> {
    vv: Sym3<V>,
    vw: Mat3<V>,
    ww: Sym3<V>,
    bv: Vec3<V>,
    bw: Vec3<V>,
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
pub(crate) fn step<V: Lanes>(
    links: &mut [Link<V>],
    scratch: &mut [Elimination<V>],
    rope: &RopeLanes<V>,
    base: &BaseLanes<V>,
    scheme: &Scheme<V>,
) -> StepReport<V> {
    let min_half_cos = eliminate(links, scratch, rope, base, scheme);
    let mut acceleration = base.a;
    let mut alpha_parent = base.alpha;
    let mut tip = Vec3::zero();
    let mut tip_velocity = Vec3::zero();
    for (link, e) in links.iter_mut().zip(scratch.iter()) {
        let driven = e.s_inv.times_add(alpha_parent.scale(rope.kappa), e.y);
        let alpha = driven.sub(e.x.transpose_times_add(acceleration, Vec3::zero()));
        acceleration = alpha.cross_add(e.span, acceleration.add(e.centripetal));
        link.correct(scheme, alpha);
        let span = link.q.down(rope.link_length);
        tip = tip.add(span);
        tip_velocity = link.w.cross_add(span, tip_velocity);
        alpha_parent = alpha;
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
fn eliminate<V: Lanes>(
    links: &mut [Link<V>],
    scratch: &mut [Elimination<V>],
    rope: &RopeLanes<V>,
    base: &BaseLanes<V>,
    scheme: &Scheme<V>,
) -> V {
    let mut min_half_cos = V::splat(1.0);
    let mut beyond = Beyond {
        vv: Sym3::diagonal(rope.lead_mass),
        vw: Mat3::zero(),
        ww: Sym3::diagonal(rope.lead_inertia),
        bv: Vec3(
            rope.lead_mass * V::splat(-side_push_m_s2::<V>()),
            rope.lead_mass * V::splat(-side_push_m_s2::<V>()),
            rope.lead_mass * V::splat(GRAVITY_M_S2),
        ),
        bw: Vec3::zero(),
    };
    let mut rest = links;
    let mut spaces = scratch;
    if let Some(last) = rest.last_mut() {
        last.predict(scheme);
    }
    while let (Some((link, nearer)), Some((space, spaces_nearer))) =
        (rest.split_last_mut(), spaces.split_last_mut())
    {
        let (parent_q, parent_w, parent_al) = match nearer.last_mut() {
            Some(parent) => {
                parent.predict(scheme);
                (parent.q, parent.w, parent.al)
            }
            None => (base.q, base.w, base.alpha),
        };
        let turn = link.q.times_conj(parent_q);
        min_half_cos = min_half_cos.min(turn.w.abs());
        let torque = joint_torque(rope, turn, link.w.sub(parent_w));
        let torque = link.al.sub(parent_al).scale_add(rope.kappa, torque);
        beyond.absorb(link, torque, rope, scheme, space);
        rest = nearer;
        spaces = spaces_nearer;
    }
    min_half_cos
}

/// Spring and damper of a joint: `-k phi - c w`, with the rotation vector `phi` of
/// `turn`. The angle over the sine of the half angle is a polynomial in
/// `1 - |cos|`; the sign flip picks the rotation of at most half a turn.
#[inline(always)]
fn joint_torque<V: Lanes>(rope: &RopeLanes<V>, turn: Quat<V>, w: Vec3<V>) -> Vec3<V> {
    let x = V::splat(1.0) - turn.w.abs();
    let mut f = V::splat(0.0);
    let mut power = V::ANGLE_POLYNOMIAL.len();
    while power > 0 {
        power -= 1;
        f = f.fma(x, V::splat(V::ANGLE_POLYNOMIAL[power]));
    }
    let spring = (f * rope.stiffness).flip_by(turn.w);
    w.scale_sub(rope.damping, turn.v.scale(-spring))
}

impl<V: Lanes> Beyond<V> {
    /// Eliminates one link: afterwards `self` is seen from its nearer node.
    #[inline(always)]
    fn absorb(
        &mut self,
        link: &Link<V>,
        torque: Vec3<V>,
        rope: &RopeLanes<V>,
        scheme: &Scheme<V>,
        out: &mut Elimination<V>,
    ) {
        let half = V::splat(0.5);
        let mass = rope.link_mass;
        let kappa = rope.kappa;
        let span = link.q.down(rope.link_length);
        let centripetal = centripetal(link, span, scheme);

        // Bias forces: what is beyond, and the link's own weight and centripetal pull.
        let u = self.vv.times_add(centripetal, self.bv);
        let lift = Vec3(
            centripetal.0.fma(half, V::splat(-side_push_m_s2::<V>())),
            centripetal.1.fma(half, V::splat(-side_push_m_s2::<V>())),
            centripetal.2.fma(half, V::splat(GRAVITY_M_S2)),
        );
        let own = lift.scale(mass);
        let bv = u.add(own);
        let bw = span.cross_add(
            own.scale_add(half, u),
            self.vw.transpose_times_add(centripetal, self.bw),
        );

        // Coupling of the nearer node's acceleration with this link's rotation.
        let p = self.vv.plus_diagonal(mass * half).rows();
        let v = Mat3([
            span.cross_add(p[0], self.vw.0[0]),
            span.cross_add(p[1], self.vw.0[1]),
            span.cross_add(p[2], self.vw.0[2]),
        ]);
        let quarter_mass = mass * V::splat(0.25);
        let s_inv = self.rotation_matrix(span, &v, rope, quarter_mass).inverse();

        let y = s_inv.times(torque.sub(bw));
        let x = Mat3([
            s_inv.times(v.0[0]),
            s_inv.times(v.0[1]),
            s_inv.times(v.0[2]),
        ]);
        self.vv = self.vv.plus_diagonal(mass).minus_product_transposed(&x, &v);
        self.vw = x.scale(kappa);
        let k2 = kappa * kappa;
        self.ww = Sym3 {
            xx: s_inv.xx.fnma(k2, kappa),
            xy: -(s_inv.xy * k2),
            xz: -(s_inv.xz * k2),
            yy: s_inv.yy.fnma(k2, kappa),
            yz: -(s_inv.yz * k2),
            zz: s_inv.zz.fnma(k2, kappa),
        };
        self.bv = v.times_add(y, bv);
        self.bw = y.scale_sub(kappa, torque);
        *out = Elimination {
            s_inv,
            y,
            x,
            span,
            centripetal,
        };
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
        let own = rope.link_inertia + rope.kappa;
        let diagonal = (quarter_mass * rope.link_length).fnma(rope.link_length, own);
        let s = self
            .ww
            .plus_diagonal(diagonal)
            .plus_outer(quarter_mass, span);
        let Vec3(x, y, z) = span;
        let [v0, v1, v2] = v.0;
        let [a0, a1, a2] = self.vw.0;
        // [span]x V + ([span]x vw)^T, upper half.
        Sym3 {
            xx: y.fma(v2.0 + a2.0, z.fnma(v1.0 + a1.0, s.xx)),
            xy: y.fma(v2.1, z.fnma(v1.1, z.fma(a0.0, x.fnma(a2.0, s.xy)))),
            xz: y.fma(v2.2, z.fnma(v1.2, x.fma(a1.0, y.fnma(a0.0, s.xz)))),
            yy: z.fma(v0.1 + a0.1, x.fnma(v2.1 + a2.1, s.yy)),
            yz: z.fma(v0.2, x.fnma(v2.2, x.fma(a1.1, y.fnma(a0.1, s.yz)))),
            zz: x.fma(v1.2 + a1.2, y.fnma(v0.2 + a0.2, s.zz)),
        }
    }
}

/// `w x (w x span)` at the extrapolated velocity: the predicted one carries the
/// dominant error of the single linear solve.
#[inline(always)]
fn centripetal<V: Lanes>(link: &Link<V>, span: Vec3<V>, scheme: &Scheme<V>) -> Vec3<V> {
    let w = link
        .al
        .sub(link.al_before)
        .scale_add(scheme.centripetal, link.w);
    w.scale(w.dot(span)).sub(span.scale(w.dot(w)))
}
