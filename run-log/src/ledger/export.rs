//! Runs as a table for people and as CSV.

use super::{Entry, RunResult};
use crate::quoted;
use anyhow::Result;
use cli_output::table::{self, Column};
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
        (result, _) => format!("{result:?}").to_lowercase(),
    }
}

/// A line per run.
pub fn table(entries: &[Entry]) -> Table {
    fn cm(m: Option<f64>) -> String {
        or_dash(m, |m| format!("{:.1}", 100.0 * m))
    }
    let columns: [Column<Entry>; 8] = [
        ("run", |e| {
            let name = e.run.file_name().unwrap_or(e.run.as_os_str());
            name.to_string_lossy().into_owned()
        }),
        ("command", |e| e.command().unwrap_or("-").to_owned()),
        ("result", result),
        ("seed", |e| or_dash(e.seed, |s| s.to_string())),
        ("rope (m)", |e| {
            or_dash(e.rope, |r| format!("{:.3}", r.length_m))
        }),
        ("plan", |e| {
            or_dash(e.plan_sha256.as_ref(), |h| {
                h.chars().take(HASH_LETTERS).collect()
            })
        }),
        ("planned (cm)", |e| cm(e.predicted_m)),
        ("achieved (cm)", |e| cm(e.true_m.or(e.camera_m))),
    ];
    table::columns(columns, 0, entries)
}

fn or_empty(value: Option<impl ToString>) -> String {
    value.map(|value| value.to_string()).unwrap_or_default()
}

/// Columns of the table for a spreadsheet; the rope's parameters follow them.
const COLUMNS: [Column<Entry>; 17] = [
    ("run", |e| e.run.display().to_string()),
    ("result", |e| format!("{:?}", e.result).to_lowercase()),
    ("problems", |e| e.problems.join("; ")),
    ("started", |e| or_empty(e.started.as_ref())),
    ("arguments", |e| {
        or_empty(e.arguments.as_ref().map(|a| quoted(a)))
    }),
    ("version", |e| or_empty(e.version.as_ref())),
    ("seed", |e| or_empty(e.seed)),
    ("task", |e| or_empty(e.task.as_ref())),
    ("target_x_m", |e| or_empty(e.target_m.map(|t| t[0]))),
    ("target_y_m", |e| or_empty(e.target_m.map(|t| t[1]))),
    ("target_z_m", |e| or_empty(e.target_m.map(|t| t[2]))),
    ("wiggle_frames", |e| or_empty(e.wiggle_frames)),
    ("plan_sha256", |e| or_empty(e.plan_sha256.as_ref())),
    ("predicted_m", |e| or_empty(e.predicted_m)),
    ("true_m", |e| or_empty(e.true_m)),
    ("camera_m", |e| or_empty(e.camera_m)),
    ("stopped_by", |e| or_empty(e.stopped_by.as_ref())),
];

/// A line per run with every value, for a spreadsheet.
pub fn csv(entries: &[Entry]) -> Result<Vec<u8>> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let names = COLUMNS.iter().map(|(name, _)| *name);
    writer.write_record(names.chain(RANGES.iter().map(|range| range.key)))?;
    for e in entries {
        let rope = e.rope.map(|r| r.to_array());
        let rope = (0..RANGES.len()).map(|i| or_empty(rope.map(|r| r[i])));
        writer.write_record(COLUMNS.iter().map(|(_, show)| show(e)).chain(rope))?;
    }
    Ok(writer.into_inner()?)
}
