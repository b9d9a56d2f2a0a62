//! Why a simulation is refused.

use core::fmt::Display;

/// Why [`crate::roll_out`] gave nothing: which option, body of the scene or candidate cannot
/// be simulated, and what it would have to be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}{reason}", candidate.map_or_else(String::new, |index| format!("candidate {index}: ")))]
pub struct SimulateError {
    /// Index of the candidate at fault, from 0, if one is.
    pub candidate: Option<usize>,
    reason: String,
}

impl SimulateError {
    /// Of an option or the scene.
    pub(crate) fn new(reason: impl Display) -> Self {
        Self {
            candidate: None,
            reason: reason.to_string(),
        }
    }

    /// Of one candidate.
    pub(crate) fn of(candidate: usize, reason: impl Display) -> Self {
        Self {
            candidate: Some(candidate),
            ..Self::new(reason)
        }
    }

    /// A worker thread ended without a result: a fault of this program.
    pub(crate) fn worker_panicked() -> Self {
        Self::new("a simulation thread ended without a result; this is a fault of the program")
    }

    /// `motion` of a candidate gave NaN or infinity.
    pub(crate) fn motion_not_finite(candidate: usize, time_s: f64) -> Self {
        Self::of(
            candidate,
            format_args!("its attach motion is not finite at {time_s} s"),
        )
    }
}

/// Refuses the first of a field's numbers that is not as it must be.
pub(crate) fn refuse_unless(
    field: &str,
    need: &str,
    numbers: impl IntoIterator<Item = f64>,
    usable: impl Fn(f64) -> bool,
) -> Result<(), String> {
    match numbers.into_iter().find(|value| !usable(*value)) {
        Some(value) => Err(format!("`{field}` is {value}: {need}")),
        None => Ok(()),
    }
}

pub(crate) fn refuse_unless_finite(
    field: &str,
    numbers: impl IntoIterator<Item = f64>,
) -> Result<(), String> {
    refuse_unless(field, "must be finite", numbers, f64::is_finite)
}

pub(crate) fn refuse_unless_positive(field: &str, number: f64) -> Result<(), String> {
    let need = "must be finite and above 0";
    refuse_unless(field, need, [number], |v| v.is_finite() && v > 0.0)
}
