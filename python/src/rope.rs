//! Ropes: rows of nine parameters, with the extras of those that have any.

use crate::error::OrRaise;
use anyhow::{Context, ensure};
use numpy::PyReadonlyArray2;
use planner::ropes;
use pyo3::prelude::*;
use run_log::files;
use serde_json::json;
use shared_types::RopeParams;
use shared_types::rope::{RANGES, ROPE_PARAMETERS};
use std::path::PathBuf;

/// A rope of `rope.toml`'s keys as JSON.
pub(crate) fn rope_of_json(text: &str) -> PyResult<RopeParams> {
    let rope: RopeParams = serde_json::from_str(text).context("rope").or_input()?;
    rope.validate().or_input()?;
    Ok(rope)
}

/// Ropes of a table of shape (ropes, 9); of those with extras, these as JSON beside it.
pub(crate) fn ropes_of_table(
    table: &PyReadonlyArray2<'_, f64>,
    extras: &[Option<String>],
) -> PyResult<Vec<RopeParams>> {
    let table = table.as_array();
    let (count, columns) = table.dim();
    let ropes = || -> anyhow::Result<Vec<RopeParams>> {
        ensure!(
            columns == ROPE_PARAMETERS,
            "ropes need {ROPE_PARAMETERS} parameters each, in the order of `wag.PARAMETERS`; \
             found {columns}"
        );
        ensure!(
            extras.is_empty() || extras.len() == count,
            "{count} ropes, but extras of {}",
            extras.len()
        );
        let one = |(index, row): (usize, numpy::ndarray::ArrayView1<'_, f64>)| {
            let rope = RopeParams::from_array(std::array::from_fn(|i| row[i]));
            let Some(Some(text)) = extras.get(index) else {
                return Ok(rope);
            };
            let extras = serde_json::from_str(text);
            let extras = extras.with_context(|| format!("extras of rope {index}"))?;
            Ok(rope.with_extras(extras))
        };
        table.outer_iter().enumerate().map(one).collect()
    };
    ropes().or_input()
}

/// Key, label, unit, smallest and largest value of each parameter.
#[pyfunction]
pub(crate) fn parameters() -> Vec<(&'static str, &'static str, &'static str, f64, f64)> {
    RANGES
        .iter()
        .map(|r| (r.key, r.label, r.unit, r.min, r.max))
        .collect()
}

/// Parameters of a rope drawn from the ranges.
#[pyfunction]
pub(crate) fn random_rope(seed: u64) -> [f64; ROPE_PARAMETERS] {
    ropes::random_rope(seed).to_array()
}

/// A strike's target (m) that suits every rope of the ranges.
#[pyfunction]
pub(crate) fn random_target(seed: u64) -> [f64; 3] {
    ropes::random_strike_target(seed)
}

/// A rope file as JSON: the rope, its posterior if it was identified, and why it should not be
/// relied on.
#[pyfunction]
pub(crate) fn read_rope(path: PathBuf) -> PyResult<String> {
    let read = || -> anyhow::Result<String> {
        Ok(json!({
            "rope": files::read_rope(&path)?,
            "posterior": files::read_posterior(&path)?,
            "unconfirmed": files::read_unconfirmed(&path)?,
        })
        .to_string())
    };
    read().or_input()
}

/// Writes a rope (JSON) as a rope file; with what its identification found (JSON), as
/// `wag identify` writes it.
#[pyfunction]
#[pyo3(signature = (path, rope, estimate = None, unconfirmed = Vec::new()))]
pub(crate) fn write_rope(
    path: PathBuf,
    rope: &str,
    estimate: Option<&str>,
    unconfirmed: Vec<String>,
) -> PyResult<()> {
    let rope = rope_of_json(rope)?;
    match estimate {
        Some(estimate) => {
            let estimate = serde_json::from_str(estimate).context("estimate");
            files::write_rope_estimate(&path, &estimate.or_input()?, &unconfirmed).or_failed()
        }
        None => {
            let text = toml::to_string(&rope).or_failed()?;
            files::write_atomic(&path, text.as_bytes()).or_failed()
        }
    }
}
