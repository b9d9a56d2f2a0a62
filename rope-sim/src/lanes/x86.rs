//! Lanes in AVX2 and AVX-512 registers.
//!
//! The wrappers are `#[inline(always)]` without target features of their own: they
//! take those of the `run_*` function they are inlined into. Calling one of their
//! intrinsics is sound only there, and the types cannot be made anywhere else:
//! they are private to this module and reach generic code only through `run_*`.

use super::lane::{ANGLE_POLYNOMIAL_F32, ANGLE_POLYNOMIAL_F64, LaneTask, Lanes};
use core::arch::x86_64::*;
use core::ops::{Add, Mul, Neg, Sub};

/// Methods of a vector type that are an expression of intrinsics.
macro_rules! wrap {
    ($(fn $method:ident($self:ident $(, $other:ident)*) => $vector:expr;)+) => {$(
        #[inline(always)]
        fn $method($self $(, $other: Self)*) -> Self {
            // SAFETY: only reached inside `run_*`, see the module's text.
            Self(unsafe { $vector })
        }
    )+};
}

macro_rules! vector_lanes {
    ($(#[$doc:meta])* $name:ident: $vector:ty, $scalar:ty, $count:literal, $polynomial:ident,
     $splat:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $sqrt:ident, $fma:ident,
     $fnma:ident,
     $min:ident, $max:ident, $and:ident, $andnot:ident, $xor:ident,
     |$a:ident, $b:ident, $then:ident, $otherwise:ident| $select:expr,
     |$left:ident, $right:ident| $any_less:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        #[repr(transparent)]
        struct $name($vector);

        impl Add for $name {
            type Output = Self;
            wrap! { fn add(self, other) => $add(self.0, other.0); }
        }
        impl Sub for $name {
            type Output = Self;
            wrap! { fn sub(self, other) => $sub(self.0, other.0); }
        }
        impl Mul for $name {
            type Output = Self;
            wrap! { fn mul(self, other) => $mul(self.0, other.0); }
        }
        impl Neg for $name {
            type Output = Self;
            wrap! { fn neg(self) => $xor(self.0, $splat(-0.0)); }
        }
        impl Lanes for $name {
            const COUNT: usize = $count;
            const ANGLE_POLYNOMIAL: &'static [f64] = $polynomial;

            wrap! {
                fn fma(self, b, c) => $fma(self.0, b.0, c.0);
                fn fnma(self, b, c) => $fnma(self.0, b.0, c.0);
                fn recip(self) => $div($splat(1.0), self.0);
                fn sqrt(self) => $sqrt(self.0);
                fn abs(self) => $andnot($splat(-0.0), self.0);
                fn flip_by(self, sign) => $xor(self.0, $and(sign.0, $splat(-0.0)));
                fn min(self, other) => $min(self.0, other.0);
                fn max(self, other) => $max(self.0, other.0);
            }
            #[inline(always)]
            #[allow(trivial_numeric_casts, reason = "one of the two types is f64")]
            fn splat(value: f64) -> Self {
                // SAFETY: only reached inside `run_*`, see the module's text.
                Self(unsafe { $splat(value as $scalar) })
            }
            #[inline(always)]
            fn get(&self, lane: usize) -> f64 {
                // SAFETY: the vector is `$count` numbers of this type and every bit pattern is one.
                let numbers: &[$scalar; $count] = unsafe { &*(&raw const self.0).cast() };
                numbers[lane.min($count - 1)].into()
            }
            #[inline(always)]
            #[allow(trivial_numeric_casts, reason = "one of the two types is f64")]
            fn set(&mut self, lane: usize, value: f64) {
                // SAFETY: as in `get`, and the borrow is unique.
                let numbers: &mut [$scalar; $count] = unsafe { &mut *(&raw mut self.0).cast() };
                numbers[lane.min($count - 1)] = value as $scalar;
            }
            #[inline(always)]
            fn select_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self {
                let ($a, $b, $then, $otherwise) = (a.0, b.0, then.0, otherwise.0);
                // SAFETY: only reached inside `run_*`, see the module's text.
                Self(unsafe { $select })
            }
            #[inline(always)]
            fn any_less(a: Self, b: Self) -> bool {
                let ($left, $right) = (a.0, b.0);
                // SAFETY: only reached inside `run_*`, see the module's text.
                unsafe { $any_less }
            }
        }
    };
}

vector_lanes!(
    /// Sixteen `f32` in one AVX-512 register.
    F32x16: __m512, f32, 16, ANGLE_POLYNOMIAL_F32,
    _mm512_set1_ps, _mm512_add_ps, _mm512_sub_ps, _mm512_mul_ps, _mm512_div_ps, _mm512_sqrt_ps,
    _mm512_fmadd_ps, _mm512_fnmadd_ps, _mm512_min_ps, _mm512_max_ps,
    _mm512_and_ps, _mm512_andnot_ps, _mm512_xor_ps,
    |a, b, then, otherwise|
        _mm512_mask_blend_ps(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b), otherwise, then),
    |a, b| _mm512_cmp_ps_mask::<_CMP_LT_OQ>(a, b) != 0
);
vector_lanes!(
    /// Eight `f64` in one AVX-512 register.
    F64x8: __m512d, f64, 8, ANGLE_POLYNOMIAL_F64,
    _mm512_set1_pd, _mm512_add_pd, _mm512_sub_pd, _mm512_mul_pd, _mm512_div_pd, _mm512_sqrt_pd,
    _mm512_fmadd_pd, _mm512_fnmadd_pd, _mm512_min_pd, _mm512_max_pd,
    _mm512_and_pd, _mm512_andnot_pd, _mm512_xor_pd,
    |a, b, then, otherwise|
        _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b), otherwise, then),
    |a, b| _mm512_cmp_pd_mask::<_CMP_LT_OQ>(a, b) != 0
);
vector_lanes!(
    /// Eight `f32` in one AVX register.
    F32x8: __m256, f32, 8, ANGLE_POLYNOMIAL_F32,
    _mm256_set1_ps, _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_sqrt_ps,
    _mm256_fmadd_ps, _mm256_fnmadd_ps, _mm256_min_ps, _mm256_max_ps,
    _mm256_and_ps, _mm256_andnot_ps, _mm256_xor_ps,
    |a, b, then, otherwise|
        _mm256_blendv_ps(otherwise, then, _mm256_cmp_ps::<_CMP_LT_OQ>(a, b)),
    |a, b| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) != 0
);
vector_lanes!(
    /// Four `f64` in one AVX register.
    F64x4: __m256d, f64, 4, ANGLE_POLYNOMIAL_F64,
    _mm256_set1_pd, _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd, _mm256_div_pd, _mm256_sqrt_pd,
    _mm256_fmadd_pd, _mm256_fnmadd_pd, _mm256_min_pd, _mm256_max_pd,
    _mm256_and_pd, _mm256_andnot_pd, _mm256_xor_pd,
    |a, b, then, otherwise|
        _mm256_blendv_pd(otherwise, then, _mm256_cmp_pd::<_CMP_LT_OQ>(a, b)),
    |a, b| _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_LT_OQ>(a, b)) != 0
);

/// Runs `task` in sixteen single precision lanes.
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
pub(super) fn run_avx512_f32<T: LaneTask>(task: T) -> T::Output {
    task.run::<F32x16>()
}

/// Runs `task` in eight double precision lanes.
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx2,fma")]
pub(super) fn run_avx512_f64<T: LaneTask>(task: T) -> T::Output {
    task.run::<F64x8>()
}

/// Runs `task` in eight single precision lanes.
#[target_feature(enable = "avx2,fma")]
pub(super) fn run_avx2_f32<T: LaneTask>(task: T) -> T::Output {
    task.run::<F32x8>()
}

/// Runs `task` in four double precision lanes.
#[target_feature(enable = "avx2,fma")]
pub(super) fn run_avx2_f64<T: LaneTask>(task: T) -> T::Output {
    task.run::<F64x4>()
}

/// Runs `task` for one rope with fused multiply-add instructions.
#[target_feature(enable = "avx2,fma")]
pub(super) fn run_fma_scalar<T: LaneTask>(task: T) -> T::Output {
    task.run::<f64>()
}
