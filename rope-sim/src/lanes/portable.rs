//! One rope in ordinary floating point: [`f64`] where fused multiply-adds are
//! instructions, [`Plain`] for any processor.
//!
//! Arrays of numbers, left to the compiler to vectorise, were three times slower per
//! rope than this: whole arrays travel through memory.

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
    fn sqrt(self) -> Self {
        f64::sqrt(self)
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

/// A number whose multiply-adds round twice, unless the target always fuses them: as
/// library calls they would be fifty times slower.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub(crate) struct Plain<S>(S);

/// Whether every processor of the target multiplies and adds in one instruction.
const HAS_FUSED: bool = cfg!(any(target_feature = "fma", target_arch = "aarch64"));

macro_rules! plain_lanes {
    ($scalar:ty, $polynomial:ident) => {
        impl Add for Plain<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Self(self.0 + other.0)
            }
        }
        impl Sub for Plain<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Self(self.0 - other.0)
            }
        }
        impl Mul for Plain<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Self(self.0 * other.0)
            }
        }
        impl Neg for Plain<$scalar> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self(-self.0)
            }
        }
        impl Lanes for Plain<$scalar> {
            const COUNT: usize = 1;
            const ANGLE_POLYNOMIAL: &'static [f64] = $polynomial;

            #[inline(always)]
            #[allow(clippy::cast_possible_truncation, reason = "the lanes' precision")]
            fn splat(value: f64) -> Self {
                Self(value as $scalar)
            }
            #[inline(always)]
            fn get(&self, _lane: usize) -> f64 {
                self.0.into()
            }
            #[inline(always)]
            fn set(&mut self, _lane: usize, value: f64) {
                *self = Self::splat(value);
            }
            #[inline(always)]
            fn fma(self, b: Self, c: Self) -> Self {
                if HAS_FUSED {
                    Self(self.0.mul_add(b.0, c.0))
                } else {
                    self * b + c
                }
            }
            #[inline(always)]
            fn fnma(self, b: Self, c: Self) -> Self {
                if HAS_FUSED {
                    Self((-self.0).mul_add(b.0, c.0))
                } else {
                    c - self * b
                }
            }
            #[inline(always)]
            fn recip(self) -> Self {
                Self(1.0 / self.0)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Self(self.0.sqrt())
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0.abs())
            }
            #[inline(always)]
            fn flip_by(self, sign: Self) -> Self {
                if sign.0.is_sign_negative() {
                    -self
                } else {
                    self
                }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self.0 < other.0 { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self.0 > other.0 { self } else { other }
            }
            #[inline(always)]
            fn select_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
                if a.0 < b.0 { then } else { otherwise }
            }
        }
    };
}

plain_lanes!(f32, ANGLE_POLYNOMIAL_F32);
plain_lanes!(f64, ANGLE_POLYNOMIAL_F64);
