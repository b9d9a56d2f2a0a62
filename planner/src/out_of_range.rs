//! A value out of range, named by its key: one form for options and configurations.

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

impl OutOfRange {
    /// Refuses the first of some rules that does not hold; a rule is a key, its value,
    /// whether it holds, and what the value must be.
    pub(crate) fn check(
        rules: impl IntoIterator<Item = (&'static str, f64, bool, &'static str)>,
    ) -> Result<(), Self> {
        match rules.into_iter().find(|(_, _, holds, _)| !holds) {
            Some((key, value, _, expected)) => Err(Self {
                key,
                value,
                expected,
            }),
            None => Ok(()),
        }
    }
}
