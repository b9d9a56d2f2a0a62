//! What every lane type can do, and the work that is written in it.

use core::ops::{Add, Mul, Neg, Sub};

/// Coefficients, lowest power first, of `2 acos(1 - x) / sqrt(1 - (1 - x)²)` on
/// [0, 1]: interpolation at the Chebyshev nodes, relative error 8e-8.
pub(crate) const ANGLE_POLYNOMIAL_F32: &[f64] = &[
    2.000_000_125_906_461_7,
    0.666_646_330_464_011_7,
    0.267_200_787_517_227_4,
    0.108_958_763_073_457_88,
    0.076_946_958_060_587_75,
    -0.047_283_462_133_373_456,
    0.117_565_466_461_353_52,
    -0.082_813_297_530_591_81,
    0.034_370_738_358_798_94,
];

/// As [`ANGLE_POLYNOMIAL_F32`], relative error 6e-11.
pub(crate) const ANGLE_POLYNOMIAL_F64: &[f64] = &[
    2.000_000_000_091_278,
    0.666_666_635_859_139,
    0.266_668_379_374_027_3,
    0.114_248_538_742_672_73,
    0.051_209_942_330_329_73,
    0.020_336_857_916_148_42,
    0.022_206_002_082_012_12,
    -0.027_080_664_336_550_51,
    0.062_088_326_438_917_825,
    -0.073_231_056_485_662_25,
    0.060_146_663_465_240_73,
    -0.027_965_434_745_319_44,
    0.006_298_462_679_425_562,
];

/// A number per rope, `COUNT` ropes side by side.
pub(crate) trait Lanes:
    Copy
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
{
    /// Number of lanes.
    const COUNT: usize;
    /// Whether a lane holds a single-precision number.
    const IS_SINGLE: bool = size_of::<Self>() == 4 * Self::COUNT;
    /// Joint angle over sine of the half angle, as a polynomial this type can resolve.
    const ANGLE_POLYNOMIAL: &'static [f64];

    /// The same number in every lane.
    fn splat(value: f64) -> Self;
    /// The number in `lane`; lanes beyond the last one read the last.
    fn get(&self, lane: usize) -> f64;
    /// Replaces the number in `lane`.
    fn set(&mut self, lane: usize, value: f64);
    /// `self * b + c`, rounded once.
    fn fma(self, b: Self, c: Self) -> Self;
    /// `c - self * b`, rounded once.
    fn fnma(self, b: Self, c: Self) -> Self;
    /// `1 / self`.
    fn recip(self) -> Self;
    /// Square root; NaN below zero.
    fn sqrt(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// `self` where `sign` is positive, `-self` where it is negative.
    fn flip_by(self, sign: Self) -> Self;
    /// Smaller of the two; `other` where one is NaN.
    fn min(self, other: Self) -> Self;
    /// Larger of the two; `other` where one is NaN.
    fn max(self, other: Self) -> Self;
    /// Lane by lane `then` where `a < b`, else `otherwise`.
    fn select_less(a: Self, b: Self, then: Self, otherwise: Self) -> Self;
    /// Whether `a < b` in any lane. Only for skipping work that would change nothing:
    /// a lane's bits must not depend on its neighbours.
    #[inline(always)]
    fn any_less(a: Self, b: Self) -> bool {
        (0..Self::COUNT).any(|lane| a.get(lane) < b.get(lane))
    }
}

/// Work written once for any [`Lanes`] type. `run` and everything it calls with
/// lanes must be `#[inline(always)]`: only then is it compiled for the
/// instruction set of the function it ends up in.
/// Closures cannot be marked so: a step must not put lanes through one, nor through
/// adapters that take one (`map`, `for_each`); it would run ten times slower.
pub(crate) trait LaneTask {
    /// What the work gives back.
    type Output;
    /// Does the work.
    fn run<V: Lanes>(self) -> Self::Output;
}
