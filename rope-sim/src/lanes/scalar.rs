//! One rope in ordinary floating point, with fused multiply-adds as the vector types have
//! them: in software, and slowly, where the processor has no such instruction.
//!
//! Arrays of numbers, left to the compiler to vectorise, were three times slower per
//! rope than this: whole arrays travel through memory.

use super::lane::{ANGLE_POLYNOMIAL_F32, ANGLE_POLYNOMIAL_F64, Lanes};

macro_rules! scalar_lane {
    ($scalar:ident, $polynomial:ident) => {
        impl Lanes for $scalar {
            const COUNT: usize = 1;
            const ANGLE_POLYNOMIAL: &'static [f64] = $polynomial;

            #[inline(always)]
            #[allow(trivial_numeric_casts, reason = "one of the two types is f64")]
            fn splat(value: f64) -> Self {
                value as $scalar
            }
            #[inline(always)]
            fn get(&self, _lane: usize) -> f64 {
                (*self).into()
            }
            #[inline(always)]
            fn set(&mut self, _lane: usize, value: f64) {
                *self = Self::splat(value);
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
                $scalar::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $scalar::abs(self)
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
    };
}

scalar_lane!(f32, ANGLE_POLYNOMIAL_F32);
scalar_lane!(f64, ANGLE_POLYNOMIAL_F64);
