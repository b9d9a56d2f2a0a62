//! Three-vectors, quaternions and 3x3 matrices over lanes. Everything is inlined
//! so that it is compiled for the instruction set of its caller.

use crate::lanes::Lanes;

/// A vector in the world frame.
#[derive(Clone, Copy)]
pub(crate) struct Vec3<V>(pub(crate) V, pub(crate) V, pub(crate) V);

impl<V: Lanes> Vec3<V> {
    #[inline(always)]
    pub(crate) fn splat(x: f64, y: f64, z: f64) -> Self {
        Self(V::splat(x), V::splat(y), V::splat(z))
    }
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self::splat(0.0, 0.0, 0.0)
    }
    #[inline(always)]
    pub(crate) fn add(self, o: Self) -> Self {
        Self(self.0 + o.0, self.1 + o.1, self.2 + o.2)
    }
    #[inline(always)]
    pub(crate) fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0, self.1 - o.1, self.2 - o.2)
    }
    #[inline(always)]
    pub(crate) fn scale(self, f: V) -> Self {
        Self(self.0 * f, self.1 * f, self.2 * f)
    }
    /// `self * f + o`.
    #[inline(always)]
    pub(crate) fn scale_add(self, f: V, o: Self) -> Self {
        Self(self.0.fma(f, o.0), self.1.fma(f, o.1), self.2.fma(f, o.2))
    }
    /// `o - self * f`.
    #[inline(always)]
    pub(crate) fn scale_sub(self, f: V, o: Self) -> Self {
        Self(
            self.0.fnma(f, o.0),
            self.1.fnma(f, o.1),
            self.2.fnma(f, o.2),
        )
    }
    #[inline(always)]
    pub(crate) fn dot(self, o: Self) -> V {
        self.0.fma(o.0, self.1.fma(o.1, self.2 * o.2))
    }
    /// Length.
    #[inline(always)]
    pub(crate) fn norm(self) -> V {
        self.dot(self).sqrt()
    }
    /// Lane by lane `then` where `a < b`, else `otherwise`.
    #[inline(always)]
    pub(crate) fn select_less(a: V, b: V, then: Self, otherwise: Self) -> Self {
        Self(
            V::select_less(a, b, then.0, otherwise.0),
            V::select_less(a, b, then.1, otherwise.1),
            V::select_less(a, b, then.2, otherwise.2),
        )
    }
    /// Smaller of each component.
    #[inline(always)]
    pub(crate) fn min(self, o: Self) -> Self {
        Self(self.0.min(o.0), self.1.min(o.1), self.2.min(o.2))
    }
    /// Larger of each component.
    #[inline(always)]
    pub(crate) fn max(self, o: Self) -> Self {
        Self(self.0.max(o.0), self.1.max(o.1), self.2.max(o.2))
    }
    /// `c + self x o`.
    #[inline(always)]
    pub(crate) fn cross_add(self, o: Self, c: Self) -> Self {
        Self(
            self.1.fma(o.2, self.2.fnma(o.1, c.0)),
            self.2.fma(o.0, self.0.fnma(o.2, c.1)),
            self.0.fma(o.1, self.1.fnma(o.0, c.2)),
        )
    }
    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> [f64; 3] {
        [self.0.get(lane), self.1.get(lane), self.2.get(lane)]
    }
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, v: [f64; 3]) {
        self.0.set(lane, v[0]);
        self.1.set(lane, v[1]);
        self.2.set(lane, v[2]);
    }
}

/// A unit quaternion, scalar first, body to world.
#[derive(Clone, Copy)]
pub(crate) struct Quat<V> {
    pub(crate) w: V,
    pub(crate) v: Vec3<V>,
}

impl<V: Lanes> Quat<V> {
    #[inline(always)]
    pub(crate) fn identity() -> Self {
        Self {
            w: V::splat(1.0),
            v: Vec3::zero(),
        }
    }
    #[inline(always)]
    pub(crate) fn times(self, o: Self) -> Self {
        let w = self.v.0.fnma(
            o.v.0,
            self.v.1.fnma(o.v.1, self.v.2.fnma(o.v.2, self.w * o.w)),
        );
        let v = self
            .v
            .cross_add(o.v, o.v.scale_add(self.w, self.v.scale(o.w)));
        Self { w, v }
    }
    /// `self` times the conjugate of `o`: the turn from `o` to `self`, in the world.
    #[inline(always)]
    pub(crate) fn times_conj(self, o: Self) -> Self {
        let w = self.w.fma(o.w, self.v.dot(o.v));
        let v =
            o.v.cross_add(self.v, o.v.scale_sub(self.w, self.v.scale(o.w)));
        Self { w, v }
    }
    /// Turned by the small world rotation vector `2 half`; not renormalised.
    #[inline(always)]
    pub(crate) fn nudged(self, half: Vec3<V>) -> Self {
        let w = half.0.fnma(
            self.v.0,
            half.1.fnma(self.v.1, half.2.fnma(self.v.2, self.w)),
        );
        let v = half.cross_add(self.v, half.scale_add(self.w, self.v));
        Self { w, v }
    }
    /// One Newton step towards unit length; exact to second order.
    #[inline(always)]
    pub(crate) fn renormalised(self) -> Self {
        let n = self.w.fma(self.w, self.v.dot(self.v));
        let f = n.fnma(V::splat(0.5), V::splat(1.5));
        Self {
            w: self.w * f,
            v: self.v.scale(f),
        }
    }
    /// The world direction of the body's -z axis times `length`.
    #[inline(always)]
    pub(crate) fn down(self, length: V) -> Vec3<V> {
        let Vec3(x, y, z) = self.v;
        let two = length + length;
        let m = -two;
        Vec3(
            m * x.fma(z, self.w * y),
            m * self.w.fnma(x, y * z),
            two.fma(x.fma(x, y * y), -length),
        )
    }
    /// Rotation by the vector `phi`, by Taylor polynomials good to 3e-13 at half a
    /// radian, in single precision to 2e-8.
    #[inline(always)]
    pub(crate) fn exp(phi: Vec3<V>) -> Self {
        let x = phi.dot(phi) * V::splat(0.25);
        let c = V::splat;
        let mut w = c(-1.0 / 720.0);
        let mut sinc = c(0.5 / 120.0);
        if !V::IS_SINGLE {
            w = x.fma(c(1.0 / 40320.0), w);
            sinc = x.fma(x.fma(c(0.5 / 362_880.0), c(-0.5 / 5040.0)), sinc);
        }
        let w = x.fma(x.fma(x.fma(w, c(1.0 / 24.0)), c(-0.5)), c(1.0));
        let sinc = x.fma(x.fma(sinc, c(-0.5 / 6.0)), c(0.5));
        Self {
            w,
            v: phi.scale(sinc),
        }
    }
    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> [f64; 4] {
        let [x, y, z] = self.v.get(lane);
        [self.w.get(lane), x, y, z]
    }
    #[inline(always)]
    pub(crate) fn set(&mut self, lane: usize, q: [f64; 4]) {
        self.w.set(lane, q[0]);
        self.v.set(lane, [q[1], q[2], q[3]]);
    }
}

/// A 3x3 matrix, by rows.
#[derive(Clone, Copy)]
pub(crate) struct Mat3<V>(pub(crate) [Vec3<V>; 3]);

impl<V: Lanes> Mat3<V> {
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        Self([Vec3::zero(); 3])
    }
    /// `self * v + c`.
    #[inline(always)]
    pub(crate) fn times_add(&self, v: Vec3<V>, c: Vec3<V>) -> Vec3<V> {
        let [r0, r1, r2] = self.0;
        Vec3(
            r0.0.fma(v.0, r0.1.fma(v.1, r0.2.fma(v.2, c.0))),
            r1.0.fma(v.0, r1.1.fma(v.1, r1.2.fma(v.2, c.1))),
            r2.0.fma(v.0, r2.1.fma(v.1, r2.2.fma(v.2, c.2))),
        )
    }
    /// `self^T * v + c`.
    #[inline(always)]
    pub(crate) fn transpose_times_add(&self, v: Vec3<V>, c: Vec3<V>) -> Vec3<V> {
        let [r0, r1, r2] = self.0;
        r0.scale_add(v.0, r1.scale_add(v.1, r2.scale_add(v.2, c)))
    }
    /// `c - self^T * v`.
    #[inline(always)]
    pub(crate) fn transpose_times_sub(&self, v: Vec3<V>, c: Vec3<V>) -> Vec3<V> {
        let [r0, r1, r2] = self.0;
        r0.scale_sub(v.0, r1.scale_sub(v.1, r2.scale_sub(v.2, c)))
    }

    #[inline(always)]
    pub(crate) fn scale(&self, f: V) -> Self {
        let [a, b, c] = self.0;
        Self([a.scale(f), b.scale(f), c.scale(f)])
    }
    /// `self + o`.
    #[inline(always)]
    pub(crate) fn add(&self, o: &Self) -> Self {
        let ([a0, a1, a2], [b0, b1, b2]) = (self.0, o.0);
        Self([a0.add(b0), a1.add(b1), a2.add(b2)])
    }
}

/// A symmetric 3x3 matrix.
#[derive(Clone, Copy)]
pub(crate) struct Sym3<V> {
    pub(crate) xx: V,
    pub(crate) xy: V,
    pub(crate) xz: V,
    pub(crate) yy: V,
    pub(crate) yz: V,
    pub(crate) zz: V,
}

impl<V: Lanes> Sym3<V> {
    #[inline(always)]
    pub(crate) fn diagonal(d: V) -> Self {
        let o = V::splat(0.0);
        Self {
            xx: d,
            xy: o,
            xz: o,
            yy: d,
            yz: o,
            zz: d,
        }
    }
    #[inline(always)]
    pub(crate) fn plus_diagonal(self, d: V) -> Self {
        Self {
            xx: self.xx + d,
            yy: self.yy + d,
            zz: self.zz + d,
            ..self
        }
    }
    /// `self + f v v^T`.
    #[inline(always)]
    pub(crate) fn plus_outer(self, f: V, v: Vec3<V>) -> Self {
        let u = v.scale(f);
        Self {
            xx: u.0.fma(v.0, self.xx),
            xy: u.0.fma(v.1, self.xy),
            xz: u.0.fma(v.2, self.xz),
            yy: u.1.fma(v.1, self.yy),
            yz: u.1.fma(v.2, self.yz),
            zz: u.2.fma(v.2, self.zz),
        }
    }
    /// `self + o`.
    #[inline(always)]
    pub(crate) fn add(self, o: Self) -> Self {
        Self {
            xx: self.xx + o.xx,
            xy: self.xy + o.xy,
            xz: self.xz + o.xz,
            yy: self.yy + o.yy,
            yz: self.yz + o.yz,
            zz: self.zz + o.zz,
        }
    }
    #[inline(always)]
    pub(crate) fn rows(&self) -> [Vec3<V>; 3] {
        [
            Vec3(self.xx, self.xy, self.xz),
            Vec3(self.xy, self.yy, self.yz),
            Vec3(self.xz, self.yz, self.zz),
        ]
    }
    /// `self * v + c`.
    #[inline(always)]
    pub(crate) fn times_add(&self, v: Vec3<V>, c: Vec3<V>) -> Vec3<V> {
        Mat3(self.rows()).times_add(v, c)
    }
    /// `self * v`.
    #[inline(always)]
    pub(crate) fn times(&self, v: Vec3<V>) -> Vec3<V> {
        let [r0, r1, r2] = self.rows();
        Vec3(r0.dot(v), r1.dot(v), r2.dot(v))
    }
    /// `self - a b^T`, whose product is known to be symmetric.
    #[inline(always)]
    pub(crate) fn minus_product_transposed(self, a: &Mat3<V>, b: &Mat3<V>) -> Self {
        let [a0, a1, a2] = a.0;
        let [b0, b1, b2] = b.0;
        Self {
            xx: minus_dot(a0, b0, self.xx),
            xy: minus_dot(a0, b1, self.xy),
            xz: minus_dot(a0, b2, self.xz),
            yy: minus_dot(a1, b1, self.yy),
            yz: minus_dot(a1, b2, self.yz),
            zz: minus_dot(a2, b2, self.zz),
        }
    }
    /// Cofactors and determinant: the inverse is the one over the other.
    #[inline(always)]
    pub(crate) fn cofactors(&self) -> (Self, V) {
        let Self {
            xx,
            xy,
            xz,
            yy,
            yz,
            zz,
        } = *self;
        let c = Self {
            xx: yz.fnma(yz, yy * zz),
            xy: xy.fnma(zz, xz * yz),
            xz: xz.fnma(yy, xy * yz),
            yy: xz.fnma(xz, xx * zz),
            yz: xx.fnma(yz, xy * xz),
            zz: xy.fnma(xy, xx * yy),
        };
        let determinant = xx.fma(c.xx, xy.fma(c.xy, xz * c.xz));
        (c, determinant)
    }
    #[inline(always)]
    pub(crate) fn scale(&self, f: V) -> Self {
        Self {
            xx: self.xx * f,
            xy: self.xy * f,
            xz: self.xz * f,
            yy: self.yy * f,
            yz: self.yz * f,
            zz: self.zz * f,
        }
    }
}

#[inline(always)]
fn minus_dot<V: Lanes>(a: Vec3<V>, b: Vec3<V>, c: V) -> V {
    a.0.fnma(b.0, a.1.fnma(b.1, a.2.fnma(b.2, c)))
}
