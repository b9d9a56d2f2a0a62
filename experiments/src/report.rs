//! What the commands print: tables for people, one JSON object for `--json`.

use cli_output::table::numbers;
use serde_json::Value;

/// A column of a table: its header, and what stands in it for a row.
pub type Column<R> = (&'static str, fn(&R) -> String);

/// Prints a table whose first column is text and whose other columns are numbers, but for
/// the last `text_columns`.
pub fn print_table<R, const N: usize>(rows: &[R], text_columns: usize, columns: [Column<R>; N]) {
    let header = columns.map(|(name, _)| name);
    let cells = rows.iter().map(|row| columns.map(|(_, cell)| cell(row)));
    println!("{}", numbers(header, text_columns, cells));
}

/// The fields of `common`, then those of `own`.
pub fn joined(mut common: Value, own: Value) -> Value {
    if let (Some(fields), Value::Object(own)) = (common.as_object_mut(), own) {
        fields.extend(own);
    }
    common
}
