//! Numbers that cannot be used.

/// A number that cannot be used.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("`{field}` is {value}: {need}")]
pub struct Unusable {
    /// Field that holds it.
    pub field: &'static str,
    /// Value found.
    pub value: f64,
    /// What it must be.
    pub need: &'static str,
}

impl Unusable {
    /// Refuses the first of a field's numbers that is not as it must be.
    pub(crate) fn unless(
        field: &'static str,
        need: &'static str,
        numbers: impl IntoIterator<Item = f64>,
        usable: impl Fn(f64) -> bool,
    ) -> Result<(), Self> {
        match numbers.into_iter().find(|value| !usable(*value)) {
            Some(value) => Err(Self { field, value, need }),
            None => Ok(()),
        }
    }

    pub(crate) fn unless_finite(
        field: &'static str,
        numbers: impl IntoIterator<Item = f64>,
    ) -> Result<(), Self> {
        Self::unless(field, "must be finite", numbers, f64::is_finite)
    }

    pub(crate) fn unless_positive(field: &'static str, number: f64) -> Result<(), Self> {
        let need = "must be finite and above 0";
        Self::unless(field, need, [number], |v| v.is_finite() && v > 0.0)
    }
}
