//! Lengths and places of a cell's file, refused with a hint where they are none.

use crate::unit::unit_hint;
use core::ops::RangeInclusive;
use serde::{Deserialize, Deserializer};

/// Largest length of anything in a cell (m).
pub(crate) const LENGTH_MAX_M: f64 = 10.0;

fn checked<'de, D: Deserializer<'de>>(
    from: D,
    range: RangeInclusive<f64>,
    expected: &str,
) -> Result<f64, D::Error> {
    let value = f64::deserialize(from)?;
    if range.contains(&value) {
        return Ok(value);
    }
    let hint = unit_hint("_m", value, LENGTH_MAX_M);
    Err(serde::de::Error::custom(format_args!(
        "{value} m is {expected}{hint}"
    )))
}

pub(crate) fn length<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    let range = f64::MIN_POSITIVE..=LENGTH_MAX_M;
    checked(from, range, "not above 0 and at most 10 m")
}

pub(crate) fn below_zero<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    let range = -LENGTH_MAX_M..=-f64::MIN_POSITIVE;
    checked(from, range, "not below 0 and at least -10 m")
}

pub(crate) fn place<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 3], D::Error> {
    let place = <[f64; 3]>::deserialize(from)?;
    match place.iter().find(|v| v.is_nan() || v.abs() > LENGTH_MAX_M) {
        None => Ok(place),
        Some(far) => Err(serde::de::Error::custom(format_args!(
            "a coordinate is {far} m, beyond 10 m{}",
            unit_hint("_m", *far, LENGTH_MAX_M)
        ))),
    }
}
