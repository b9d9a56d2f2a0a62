//! Vectors of ropes: the number type the whole simulator is written in.
//!
//! One lane is one rope. Every operation acts on each lane alone, so a lane's bits
//! do not depend on its position or its neighbours, and every type fuses multiply-adds,
//! so kernels of one precision agree bit by bit. This is the only module with `unsafe` code: the
//! wrappers over `core::arch` in [`x86`] and the call into code compiled for the
//! processor found at run time.
#![allow(
    unsafe_code,
    reason = "vector instructions and calls into code compiled for them need it"
)]

mod lane;
mod scalar;
#[cfg(target_arch = "x86_64")]
mod x86;

pub(crate) use lane::{LaneTask, Lanes};

/// One compiled form of the simulator: instruction set, number type, lanes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// 16 single precision lanes, AVX-512.
    Avx512F32,
    /// 8 single precision lanes, AVX2 and FMA.
    Avx2F32,
    /// One rope in single precision, on processors other than x86-64.
    ScalarF32,
    /// 8 double precision lanes, AVX-512.
    Avx512F64,
    /// 4 double precision lanes, AVX2 and FMA.
    Avx2F64,
    /// One rope in double precision, any processor; slow where it has no fused
    /// multiply-adds.
    ScalarF64,
}

impl Kernel {
    /// All forms, fastest first within a precision.
    pub const ALL: [Self; 6] = [
        Self::Avx512F32,
        Self::Avx2F32,
        Self::ScalarF32,
        Self::Avx512F64,
        Self::Avx2F64,
        Self::ScalarF64,
    ];

    /// Ropes advanced side by side.
    #[must_use]
    pub const fn lanes(self) -> usize {
        match self {
            Self::Avx512F32 => 16,
            Self::Avx2F32 | Self::Avx512F64 => 8,
            Self::Avx2F64 => 4,
            Self::ScalarF32 | Self::ScalarF64 => 1,
        }
    }

    /// Whether it computes in single precision.
    #[must_use]
    pub const fn is_single_precision(self) -> bool {
        matches!(self, Self::Avx512F32 | Self::Avx2F32 | Self::ScalarF32)
    }

    /// Whether this processor can run it.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Avx512F32 | Self::Avx512F64 => has_avx512(),
            Self::Avx2F32 | Self::Avx2F64 => has_avx2(),
            Self::ScalarF32 => cfg!(not(target_arch = "x86_64")),
            Self::ScalarF64 => true,
        }
    }

    /// Runs `task` in this form, which this processor must have.
    pub(crate) fn run<T: LaneTask>(self, task: T) -> T::Output {
        debug_assert!(self.is_available(), "{self:?}");
        #[cfg(target_arch = "x86_64")]
        match self {
            // SAFETY: the processor has AVX-512 F, DQ, VL, AVX2 and FMA, checked just before.
            Self::Avx512F32 if has_avx512() => return unsafe { x86::run_avx512_f32(task) },
            // SAFETY: the processor has AVX2 and FMA, checked just before.
            Self::Avx2F32 if has_avx2() => return unsafe { x86::run_avx2_f32(task) },
            _ => {}
        }
        #[cfg(not(target_arch = "x86_64"))]
        if self == Self::ScalarF32 {
            return task.run::<f32>();
        }
        self.run_double(task)
    }

    /// [`Kernel::run`] for tasks of double precision: single-precision forms fall back to
    /// one rope. What only ever runs so is not compiled for the other forms.
    pub(crate) fn run_double<T: LaneTask>(self, task: T) -> T::Output {
        #[cfg(target_arch = "x86_64")]
        match self {
            // SAFETY: the processor has AVX-512 F, DQ, VL, AVX2 and FMA, checked just before.
            Self::Avx512F64 if has_avx512() => return unsafe { x86::run_avx512_f64(task) },
            // SAFETY: the processor has AVX2 and FMA, checked just before.
            Self::Avx2F64 if has_avx2() => return unsafe { x86::run_avx2_f64(task) },
            _ => {}
        }
        run_scalar(task)
    }
}

/// Runs `task` for one rope in double precision.
pub(crate) fn run_scalar<T: LaneTask>(task: T) -> T::Output {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        // SAFETY: the processor has AVX2 and FMA, checked just before.
        return unsafe { x86::run_fma_scalar(task) };
    }
    task.run::<f64>()
}

/// Number type of the simulation. Errors of [`Precision::F32`] level off at 0.01-0.13
/// mm after seconds of motion; it is about twice as fast.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Precision {
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

impl Precision {
    /// Fastest kernel of this precision on this processor.
    #[must_use]
    pub fn fastest_kernel(self) -> Kernel {
        let single = self == Self::F32;
        Kernel::ALL
            .into_iter()
            .find(|k| k.is_single_precision() == single && k.is_available())
            .unwrap_or(Kernel::ScalarF64)
    }
}

fn has_avx512() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && has_avx2()
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}

fn has_avx2() -> bool {
    #[cfg(target_arch = "x86_64")]
    {
        is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma")
    }
    #[cfg(not(target_arch = "x86_64"))]
    false
}

#[cfg(test)]
mod tests {
    use super::lane::{ANGLE_POLYNOMIAL_F32, ANGLE_POLYNOMIAL_F64};
    use super::*;

    fn polynomial(coefficients: &[f64], x: f64) -> f64 {
        coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
    }

    #[test]
    fn angle_polynomials_match_the_arc_cosine() {
        for i in 1..=1000 {
            let w = 1.0 - f64::from(i) / 1000.0;
            let want = 2.0 * w.acos() / (1.0 - w * w).sqrt();
            for (coefficients, bound) in
                [(ANGLE_POLYNOMIAL_F32, 1e-7), (ANGLE_POLYNOMIAL_F64, 1e-10)]
            {
                let got = polynomial(coefficients, 1.0 - w);
                assert!(
                    (got / want - 1.0).abs() < bound,
                    "w {w}: {got} against {want}"
                );
            }
        }
    }

    struct EveryOperation;

    impl LaneTask for EveryOperation {
        type Output = Vec<[f64; 11]>;
        #[inline(always)]
        fn run<V: Lanes>(self) -> Self::Output {
            let (mut a, mut b) = (V::splat(1.5), V::splat(-2.25));
            for lane in 0..V::COUNT {
                a.set(lane, 1.5 + 0.25 * lane as f64);
                b.set(lane, if lane % 2 == 0 { -2.25 } else { 1.75 });
            }
            let results = [
                a + b,
                a - b,
                a * b,
                -a,
                a.fma(b, a),
                a.fnma(b, a),
                b.recip().abs(),
                a.flip_by(b),
                a.min(b) + a.max(b) * V::splat(8.0),
                V::select_less(a, b, V::splat(1.0), V::splat(2.0)),
                a.sqrt(),
            ];
            (0..V::COUNT)
                .map(|lane| core::array::from_fn(|i| results[i].get(lane)))
                .collect()
        }
    }

    #[test]
    fn every_lane_type_does_the_same_arithmetic() {
        for kernel in Kernel::ALL.into_iter().filter(|k| k.is_available()) {
            let lanes = kernel.run(EveryOperation);
            assert_eq!(lanes.len(), kernel.lanes());
            for (lane, got) in lanes.into_iter().enumerate() {
                let a = 1.5 + 0.25 * lane as f64;
                let b = if lane % 2 == 0 { -2.25_f64 } else { 1.75 };
                let want = [
                    a + b,
                    a - b,
                    a * b,
                    -a,
                    a * b + a,
                    a - a * b,
                    (1.0 / b).abs(),
                    if b < 0.0 { -a } else { a },
                    a.min(b) + 8.0 * a.max(b),
                    if a < b { 1.0 } else { 2.0 },
                    a.sqrt(),
                ];
                for (g, w) in got.into_iter().zip(want) {
                    assert!(
                        (g - w).abs() < 1e-6,
                        "{kernel:?} lane {lane}: {g} against {w}"
                    );
                }
            }
        }
    }
}
