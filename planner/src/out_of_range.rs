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
}
