//! What an export has written.

use serde_json::{Value, json};
use std::path::PathBuf;

/// A file of an export.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WrittenFile {
    /// Where it is.
    pub path: PathBuf,
    /// How many there are in it,
    pub count: u64,
    /// and of what: `rows`, `messages`.
    pub of: &'static str,
}

/// What an export has written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    /// The run, as it was named.
    pub run: PathBuf,
    /// The files, the main one first.
    pub files: Vec<WrittenFile>,
    /// What else a program wants to know of it: a JSON object.
    pub figures: Value,
    /// What the run lacks that the format has a place for; of several runs, each entry is a
    /// sentence that names its run.
    pub missing: Vec<String>,
}

impl Written {
    /// All of it as one JSON object, of the command `wag export FORMAT`.
    #[must_use]
    pub fn report(&self, format: &str) -> Value {
        let files: Vec<_> = self.files.iter().map(|file| &file.path).collect();
        let mut report = json!({
            "ok": true, "command": format!("export {format}"), "run": self.run, "files": files,
        });
        if !self.missing.is_empty() {
            report["missing"] = json!(self.missing);
        }
        for (key, value) in self.figures.as_object().into_iter().flatten() {
            report[key] = value.clone();
        }
        report
    }
}
