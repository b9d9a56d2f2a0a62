//! The articulated inertia outboard of a node, and the elimination of one link.

use super::link::{Elimination, up};
use crate::algebra::{Mat3, Sym3, Vec3};
use crate::lanes::Lanes;
use crate::load::Load;
use crate::state::RopeLanes;

/// Articulated inertia of everything outboard of node i: its reaction on link i, for an acceleration `a` of the
/// node and the angular acceleration `alpha` of the link: `force = vv a + vw alpha +
/// bv`, `torque = vw^T a + ww alpha + bw`.
pub(super) struct Outboard<V> {
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
pub(super) struct HalfEliminated<V> {
    v: Mat3<V>,
    /// Cofactors of the matrix to invert, and the inverse of its determinant.
    cofactors: Sym3<V>,
    per_determinant: V,
    /// `vv cent + bv` with half the link's own share, and its torque.
    force: Vec3<V>,
    bw: Vec3<V>,
}

impl<V: Lanes> Outboard<V> {
    /// Adds what touches the link, in units of the joint resistance.
    #[inline(always)]
    pub(super) fn add(&mut self, load: &Load<V>, per_resistance: V) {
        let u = per_resistance;
        self.vv_link = load.vv.scale(u).add(self.vv_link);
        self.vw = load.vw.scale(u).add(&self.vw);
        self.one_less_ww = load.ww.scale(-u).add(self.one_less_ww);
        self.bv_link = load.bv.scale_add(u, self.bv_link);
        self.bw = load.bw.scale_add(u, self.bw);
    }

    #[inline(always)]
    pub(super) fn lead(rope: &RopeLanes<V>) -> Self {
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
    pub(super) fn open(
        &self,
        rope: &RopeLanes<V>,
        span: Vec3<V>,
        centripetal: Vec3<V>,
    ) -> HalfEliminated<V> {
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
    pub(super) fn close(
        &mut self,
        rope: &RopeLanes<V>,
        space: &mut Elimination<V>,
        half: &HalfEliminated<V>,
    ) {
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
