//! Loops over pixels in the widest vectors the processor has.

use pulp::{Arch, Simd, WithSimd};

struct Work<F>(F);

impl<R, F: FnOnce() -> R> WithSimd for Work<F> {
    type Output = R;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> R {
        (self.0)()
    }
}

/// Runs `work`, itself and what is inlined into it compiled for what the processor can
/// do. The results have the same bits everywhere.
pub(crate) fn widest<R>(work: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(Work(work))
}
