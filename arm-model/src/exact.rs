//! Operations whose result IEEE 754 lays down to the bit, so that it does not matter
//! whose they are: the processor's with `std`, `libm`'s without.
//!
//! Sines are not among them and come from `libm` everywhere.

/// Square root, rounded to nearest. RT-safe.
#[must_use]
pub fn sqrt(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.sqrt();
    #[cfg(not(feature = "std"))]
    return libm::sqrt(x);
}

/// Nearest integer, halves away from zero. RT-safe.
#[must_use]
pub fn round(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return x.round();
    #[cfg(not(feature = "std"))]
    return libm::round(x);
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn both_have_the_same_bits(x in proptest::num::f64::ANY) {
            let same = |a: f64, b: f64| a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan();
            prop_assert!(same(super::sqrt(x), libm::sqrt(x)));
            prop_assert!(same(super::round(x), libm::round(x)));
        }
    }
}
