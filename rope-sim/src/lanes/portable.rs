//! Lanes without vector instructions: one `f64`, and plain arrays that the
//! compiler may vectorise with whatever the target has.

use super::{ANGLE_POLYNOMIAL_F32, ANGLE_POLYNOMIAL_F64, Lanes};
use core::ops::{Add, Mul, Neg, Sub};

impl Lanes for f64 {
    const COUNT: usize = 1;
    const ANGLE_POLYNOMIAL: &'static [f64] = ANGLE_POLYNOMIAL_F64;

    #[inline(always)]
    fn splat(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn get(&self, _lane: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn set(&mut self, _lane: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }
    #[inline(always)]
    fn fnma(self, b: Self, c: Self) -> Self {
        (-self).mul_add(b, c)
    }
    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
    #[inline(always)]
    fn flip_by(self, sign: Self) -> Self {
        if sign.is_sign_negative() { -self } else { self }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn select_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
        if a < b { then } else { otherwise }
    }
}

/// Whether the target multiplies and adds in one instruction. Where it does not, a
/// fused operation is a library call some fifty times slower than two instructions.
const HAS_FUSED: bool = cfg!(any(target_feature = "fma", target_arch = "aarch64"));

/// `N` numbers of type `S` side by side. Multiply-adds round twice on targets that
/// cannot fuse them.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub(crate) struct Array<S, const N: usize>([S; N]);

macro_rules! array_lanes {
    ($scalar:ty, $polynomial:ident) => {
        impl<const N: usize> Add for Array<$scalar, N> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(core::array::from_fn(|i| self.0[i] + other.0[i]))
            }
        }
        impl<const N: usize> Sub for Array<$scalar, N> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(core::array::from_fn(|i| self.0[i] - other.0[i]))
            }
        }
        impl<const N: usize> Mul for Array<$scalar, N> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self(core::array::from_fn(|i| self.0[i] * other.0[i]))
            }
        }
        impl<const N: usize> Neg for Array<$scalar, N> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(self.0.map(|v| -v))
            }
        }
        impl<const N: usize> Lanes for Array<$scalar, N> {
            const COUNT: usize = N;
            const ANGLE_POLYNOMIAL: &'static [f64] = $polynomial;

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, reason = "the lanes' precision")]
            #[allow(trivial_numeric_casts, reason = "one of the two types is f64")]
            fn splat(value: f64) -> Self {
                Self([value as $scalar; N])
            }
            #[inline(always)]
            fn get(&self, lane: usize) -> f64 {
                self.0[lane.min(N - 1)].into()
            }
            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, reason = "the lanes' precision")]
            #[allow(trivial_numeric_casts, reason = "one of the two types is f64")]
            fn set(&mut self, lane: usize, value: f64) {
                self.0[lane.min(N - 1)] = value as $scalar;
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                Self(core::array::from_fn(|i| {
                    if HAS_FUSED {
                        self.0[i].mul_add(b.0[i], c.0[i])
                    } else {
                        self.0[i] * b.0[i] + c.0[i]
                    }
                }))
            }
            #[inline(always)]
            fn fnma(self, b: Self, c: Self) -> Self {
                Self(core::array::from_fn(|i| {
                    (-self.0[i]).mul_add(b.0[i], c.0[i])
                }))
            }
            #[inline(always)]
            fn recip(self) -> Self {
                Self(self.0.map(|v| 1.0 / v))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0.map(|v| v.abs()))
            }
            #[inline(always)]
            fn flip_by(self, sign: Self) -> Self {
                Self(core::array::from_fn(|i| {
                    if sign.0[i].is_sign_negative() {
                        -self.0[i]
                    } else {
                        self.0[i]
                    }
                }))
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self::select_less(self, other, self, other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self::select_less(other, self, self, other)
            }
            #[inline(always)]
            fn select_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
                Self(core::array::from_fn(|i| {
                    if a.0[i] < b.0[i] {
                        then.0[i]
                    } else {
                        otherwise.0[i]
                    }
                }))
            }
        }
    };
}

array_lanes!(f32, ANGLE_POLYNOMIAL_F32);
array_lanes!(f64, ANGLE_POLYNOMIAL_F64);
