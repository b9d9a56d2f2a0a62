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

/// A column: its name, and what it shows of a row.
pub type Column<T> = (&'static str, fn(&T) -> String);

/// [`numbers`] of rows and what each column shows of them.
pub fn columns<T, const N: usize>(
    columns: [Column<T>; N],
    text_columns: usize,
    rows: &[T],
) -> Table {
    let cells = rows.iter().map(|row| columns.map(|(_, show)| show(row)));
    numbers(columns.map(|(name, _)| name), text_columns, cells)
}

/// Significant digits of a deviation; a value is told as far down as its deviation.
const DIGITS: i32 = 3;
/// Significant digits of a value whose deviation is not known.
const DIGITS_ALONE: i32 = 4;

/// Decimals that show `digits` significant ones of `value`.
fn decimals(value: f64, digits: i32) -> usize {
    if value == 0.0 || !value.is_finite() {
        return 1;
    }
    #[allow(
        clippy::cast_possible_truncation,
        reason = "a logarithm of a finite number is a small number"
    )]
    let before = value.abs().log10().floor() as i32 + 1;
    usize::try_from(digits - before).unwrap_or(0).min(12)
}

/// A value with the decimals its deviation deserves.
pub fn number(value: f64, std_dev: Option<f64>) -> String {
    let decimals = match std_dev {
        Some(s) if s > 0.0 => decimals(s, DIGITS),
        _ => decimals(value, DIGITS_ALONE),
    };
    format!("{value:.decimals$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_is_told_as_far_down_as_its_deviation() {
        assert_eq!(number(0.551_234_5, Some(0.001_234_5)), "0.55123");
        assert_eq!(number(0.000_059_87, None), "0.00005987");
        assert_eq!(number(23.0, None), "23.00");
        assert_eq!(number(12_345.6, Some(250.0)), "12346");
        assert_eq!(number(0.0, None), "0.0");
    }
}
