//! Tables for people, numbers to the right; they paste into a notebook as
//! Markdown.

use comfy_table::{CellAlignment, Table, presets};

/// A table whose first column is text and whose other columns are numbers, but
/// for the last `text_columns`.
pub fn numbers<const N: usize>(
    header: [&str; N],
    text_columns: usize,
    rows: impl IntoIterator<Item = [String; N]>,
) -> Table {
    let mut table = Table::new();
    table.load_style(presets::ASCII_MARKDOWN);
    table.set_header(header);
    for row in rows {
        table.add_row(row);
    }
    for column in 1..N.saturating_sub(text_columns) {
        if let Some(c) = table.column_mut(column) {
            c.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

/// A standard deviation, or that the observation says nothing.
pub fn std_dev(value: Option<f64>) -> String {
    value.map_or_else(|| "not seen".to_owned(), |s| format!("{s:.4}"))
}
