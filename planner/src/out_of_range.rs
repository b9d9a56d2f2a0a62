//! A value out of range, named by its key: one form for options and configurations.

use std::ops::RangeInclusive;

/// A value that is not what it must be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("`{key}` is {value}, but must be {expected}")]
pub struct OutOfRange {
    /// Its key or option.
    pub key: &'static str,
    /// Value found.
    pub value: f64,
    /// What it must be.
    pub expected: &'static str,
}

/// A key, its value, whether that is what it must be, and what it must be.
pub type Rule = (&'static str, f64, bool, &'static str);

impl OutOfRange {
    /// Checks some rules.
    ///
    /// # Errors
    /// The first that does not hold.
    pub fn check(rules: impl IntoIterator<Item = Rule>) -> Result<(), Self> {
        match rules.into_iter().find(|(_, _, holds, _)| !holds) {
            Some((key, value, _, expected)) => Err(Self {
                key,
                value,
                expected,
            }),
            None => Ok(()),
        }
    }

    /// Refuses the first of some keys and their values that is not in the range.
    pub(crate) fn unless_within(
        range: RangeInclusive<f64>,
        expected: &'static str,
        values: &[(&'static str, f64)],
    ) -> Result<(), Self> {
        let rule = |(key, value): &(_, f64)| (*key, *value, range.contains(value), expected);
        Self::check(values.iter().map(rule))
    }

    /// Refuses numbers that are not finite.
    pub(crate) fn unless_finite(values: &[(&'static str, f64)]) -> Result<(), Self> {
        Self::unless_within(f64::MIN..=f64::MAX, "finite", values)
    }
}
