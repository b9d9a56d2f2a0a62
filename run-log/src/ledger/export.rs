//! Runs as a table for people and as CSV.

use super::{Entry, RunResult};
use crate::quoted;
use anyhow::Result;
use cli_output::table;
use comfy_table::Table;
use shared_types::rope::RANGES;

/// Letters of a hash that tell plans apart for people.
const HASH_LETTERS: usize = 8;

fn or_dash<T>(value: Option<T>, show: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "-".to_owned(), show)
}

fn result(entry: &Entry) -> String {
    match (entry.result, &entry.stopped_by) {
        (RunResult::Failed, Some(code)) => format!("stopped: {code}"),
        (RunResult::Ok, _) => "ok".to_owned(),
        (RunResult::Failed, None) => "failed".to_owned(),
        (RunResult::Broken, _) => "broken".to_owned(),
    }
}

/// A line per run.
pub fn table(entries: &[Entry]) -> Table {
    let cm = |m: f64| format!("{:.1}", 100.0 * m);
    let rows = entries.iter().map(|e| {
        [
            e.run.file_name().map_or_else(
                || e.run.display().to_string(),
                |name| name.to_string_lossy().into_owned(),
            ),
            e.command().unwrap_or("-").to_owned(),
            result(e),
            or_dash(e.seed, |s| s.to_string()),
            or_dash(e.rope, |r| format!("{:.3}", r.length_m)),
            or_dash(e.plan_sha256.as_ref(), |h| {
                h.chars().take(HASH_LETTERS).collect()
            }),
            or_dash(e.predicted_m, cm),
            or_dash(e.true_m.or(e.camera_m), cm),
        ]
    });
    let header = [
        "run",
        "command",
        "result",
        "seed",
        "rope (m)",
        "plan",
        "planned (cm)",
        "achieved (cm)",
    ];
    table::numbers(header, 0, rows)
}

/// A line per run with every value, for a spreadsheet.
///
/// # Errors
/// The table cannot be put together.
pub fn csv(entries: &[Entry]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header = vec![
        "run",
        "result",
        "problems",
        "started",
        "arguments",
        "version",
        "seed",
        "task",
        "target_x_m",
        "target_y_m",
        "target_z_m",
        "wiggle_frames",
        "plan_sha256",
        "predicted_m",
        "true_m",
        "camera_m",
        "stopped_by",
    ];
    header.extend(RANGES.iter().map(|range| range.key));
    writer.write_record(&header)?;
    let number = |value: Option<f64>| value.map_or_else(String::new, |v| v.to_string());
    for e in entries {
        let mut row = vec![
            e.run.display().to_string(),
            format!("{:?}", e.result).to_lowercase(),
            e.problems.join("; "),
            e.started.clone().unwrap_or_default(),
            e.arguments.as_ref().map(|a| quoted(a)).unwrap_or_default(),
            e.version.clone().unwrap_or_default(),
            e.seed.map(|s| s.to_string()).unwrap_or_default(),
            e.task.clone().unwrap_or_default(),
        ];
        row.extend((0..3).map(|axis| number(e.target_m.map(|t| t[axis]))));
        row.push(e.wiggle_frames.map(|n| n.to_string()).unwrap_or_default());
        row.push(e.plan_sha256.clone().unwrap_or_default());
        row.extend([e.predicted_m, e.true_m, e.camera_m].map(number));
        row.push(e.stopped_by.clone().unwrap_or_default());
        let rope = e.rope.map(|r| r.to_array());
        row.extend((0..RANGES.len()).map(|i| number(rope.map(|r| r[i]))));
        writer.write_record(&row)?;
    }
    Ok(writer.into_inner()?)
}
