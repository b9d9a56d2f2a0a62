//! The identified rope as rows of a table.

use super::data::RopeRow;
use anyhow::Context;
use run_log::files;
use serde_json::Value;
use shared_types::RopeParams;
use shared_types::rope::RANGES;
use std::path::Path;

/// Rows of a rope with the intervals in its file; `truth` is what a simulated rig said
/// about it.
pub(crate) fn rows(
    params: &RopeParams,
    path: &Path,
    truth: &Value,
) -> anyhow::Result<Vec<RopeRow>> {
    let table: toml::Table = toml::from_str(&files::read_text(path)?)
        .with_context(|| format!("rope file `{}`", path.display()))?;
    let interval = |key: &str| {
        let ends = table.get("interval_90")?.get(key)?.as_array()?;
        match ends.iter().map(toml::Value::as_float).collect::<Vec<_>>()[..] {
            [Some(low), Some(high)] => Some([low, high]),
            _ => None,
        }
    };
    Ok(RANGES
        .iter()
        .zip(params.to_array())
        .map(|(range, value)| RopeRow {
            label: range.label,
            unit: range.unit,
            value,
            interval_90: interval(range.key),
            range: [range.min, range.max],
            truth: truth[range.key].as_f64(),
        })
        .collect())
}
