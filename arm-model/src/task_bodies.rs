//! The bodies that lobs and drapes are thrown at: board, domino and wall.
//!
//! Each stands where the target says, turned to the bearing of the target from the base
//! axis. Edges are outwards (away from the base axis), across and down.

use crate::checked_length::{LENGTH_MAX_M, length};
use crate::unit::unit_hint;
use serde::{Deserialize, Deserializer, Serialize};

/// A level board on a column, its upper face at the target's height.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Edges (m).
    #[serde(deserialize_with = "edges")]
    pub size_m: [f64; 3],
    /// Radius of the column below it (m).
    #[serde(deserialize_with = "length")]
    pub column_radius_m: f64,
    /// Coefficient of friction against rope and lead (1).
    #[serde(deserialize_with = "friction")]
    pub friction: f64,
}

/// A domino that stands on the board, broad faces inwards and outwards.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StandingDomino {
    /// Thickness, width and height (m).
    #[serde(deserialize_with = "edges")]
    pub size_m: [f64; 3],
    /// How much closer to the base axis than the target it stands (m).
    #[serde(deserialize_with = "length")]
    pub before_target_m: f64,
    /// Mass (kg).
    #[serde(deserialize_with = "mass")]
    pub mass_kg: f64,
    /// Coefficient of friction against rope and lead (1).
    #[serde(deserialize_with = "friction")]
    pub friction: f64,
}

/// A wall, the middle of its upper edge at the target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wall {
    /// Edges (m).
    #[serde(deserialize_with = "edges")]
    pub size_m: [f64; 3],
    /// Coefficient of friction against rope and lead (1).
    #[serde(deserialize_with = "friction")]
    pub friction: f64,
}

fn edges<'de, D: Deserializer<'de>>(from: D) -> Result<[f64; 3], D::Error> {
    let edges = <[f64; 3]>::deserialize(from)?;
    let is_length = |edge: &f64| *edge > 0.0 && *edge <= LENGTH_MAX_M;
    match edges.iter().find(|edge| !is_length(edge)) {
        None => Ok(edges),
        Some(edge) => Err(serde::de::Error::custom(format_args!(
            "an edge is {edge} m, not above 0 and at most 10 m{}",
            unit_hint("_m", *edge, LENGTH_MAX_M)
        ))),
    }
}

fn within<'de, D: Deserializer<'de>>(from: D, max: f64, unit: &str) -> Result<f64, D::Error> {
    let value = f64::deserialize(from)?;
    if value > 0.0 && value <= max {
        return Ok(value);
    }
    Err(serde::de::Error::custom(format_args!(
        "{value}{unit} is not above 0 and at most {max}{unit}"
    )))
}

fn mass<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    within(from, 10.0, " kg")
}

fn friction<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    within(from, 2.0, "")
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use crate::Cell;

    #[test]
    fn bodies_are_checked_by_key_and_a_cell_without_them_has_those_of_the_laboratory() {
        let text = include_str!("../../configs/cell/lab.toml");
        for (from, to, says) in [
            ("size_m = [0.30,", "size_m = [300.0,", "an edge is 300 m"),
            ("mass_kg = 0.010", "mass_kg = 0.0", "0 kg is not above 0"),
            ("friction = 0.6", "friction = 6.0", "6 is not above 0"),
            ("before_target_m", "before_m", "before_m"),
        ] {
            let refusal = toml::from_str::<Cell>(&text.replace(from, to)).unwrap_err();
            assert!(refusal.to_string().contains(says), "{to}: {refusal}");
        }
        let older = text.split("# What a lob is thrown at").next().unwrap();
        assert!(older.len() < text.len());
        assert_eq!(toml::from_str::<Cell>(older).unwrap(), Cell::default());
    }
}
