//! What the commands print: tables for people, one JSON object for `--json`.

use crate::args::BenchArgs;
use cli_output::Machine;
pub use cli_output::table::Column;
use cli_output::table::columns;
use serde_json::{Value, json};

/// Prints a table whose first column is text and whose other columns are numbers, but for
/// the last `text_columns`.
pub fn print_table<R, const N: usize>(rows: &[R], text_columns: usize, table: [Column<R>; N]) {
    println!("{}", columns(table, text_columns, rows));
}

/// The fields of `common`, then those of `own`.
pub fn joined(mut common: Value, own: Value) -> Value {
    if let (Some(fields), Value::Object(own)) = (common.as_object_mut(), own) {
        fields.extend(own);
    }
    common
}

/// Prints a benchmark's machine and tables, and returns what `--json` prints: `own` fields
/// in addition to those of every benchmark.
pub fn report(args: &BenchArgs, command: &str, own: Value, print: impl FnOnce()) -> Option<Value> {
    let machine = Machine::here();
    println!("{machine}");
    print();
    let common = json!({
        "ok": true, "command": command, "machine": machine, "seed": args.seed,
        "quick": args.quick,
    });
    Some(joined(common, own))
}

/// Whether a time limit (s) was kept.
pub fn verdict(limit_s: f64, kept: bool) -> String {
    format!("{limit_s} s {}", if kept { "kept" } else { "exceeded" })
}
